function dx = body_derivative(x, force, torque, body)
% A rigid body in a uniform gravity field, 6 degrees of freedom.
% x = [p (NED, m); v (NED, m/s); q (body to NED); w (body, rad/s)]. force (N, NED) acts at the
% centre of mass and leaves gravity out; torque (N m) is in body axes.
w = x(11:13);
dx = [x(4:6)
      force / body.mass + [0; 0; body.gravity]
      0.5 * quaternion_product(x(7:10), [0; w])
      body.inertia \ (torque - cross_matrix(w) * (body.inertia * w))];
end

function r = rotation_to_body(q)
% NED-to-body matrix R of a body-to-NED quaternion [w; x; y; z]: v_body = R v_ned.
% The transpose of Sola (2017), eq. 115, which turns body into NED.
w = q(1);
u = q(2:4);
to_ned = (w^2 - u' * u) * eye(3) + 2 * (u * u') + 2 * w * cross_matrix(u);
r = to_ned';
end

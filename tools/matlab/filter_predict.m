function f = filter_predict(f, settings, accel, gyro, dt)
% One step of the nominal state and of P (DESIGN.md, 4), dense.
%   d(dp)/dt = dv
%   d(dv)/dt = -R' [f x] alpha - R' db_a
%   d(alpha)/dt = -[w x] alpha - db_g
% Injecting alpha turned the frame in which alpha is written by alpha/2 (Sola, eq. 287): Phi takes
% that turn with the gyro's, to first order in both.
% Phi = I + F dt, and Q_d is the integral of (I + F s) Qc (I + F s)' over s = 0 .. dt.
R = rotation_to_body(f.q);
force = accel - f.b_a;
w = gyro - f.b_g;

n = f.states;
F = zeros(n);
F(1:3, 4:6) = eye(3);
F(4:6, 7:9) = -R' * cross_matrix(force);
F(7:9, 7:9) = -cross_matrix(w);
noise = [0, settings.accelNoise, settings.gyroNoise];
if n == 18
  F(4:6, 10:12) = -R';
  F(7:9, 13:15) = -eye(3);
  noise = [noise, settings.accelBiasWalk, settings.gyroBiasWalk, settings.magBiasWalk];
end
Qc = diag(kron(noise.^2, [1, 1, 1]));
Phi = eye(n) + F * dt;
Phi(7:9, 7:9) = Phi(7:9, 7:9) - cross_matrix(f.reset);
f.reset = zeros(3, 1);
Qd = Qc * dt + (F * Qc + Qc * F') * dt^2 / 2 + F * Qc * F' * dt^3 / 3;
f.P = Phi * f.P * Phi' + Qd;

acceleration = R' * force + [0; 0; settings.gravity];
f.p = f.p + f.v * dt + acceleration * dt^2 / 2;
f.v = f.v + acceleration * dt;
f.q = quaternion_product(f.q, quaternion_exp(w * dt));
f.q = f.q / norm(f.q);
end

function write_gains(file, made_by, vehicle)
% Linear-quadratic regulator at hover and yaw 0 for the sampled model at the control rate.
% x = [position, velocity, alpha, body rate]; forward, right, down.
% u = [thrust, tau_x, tau_y, tau_z].
% Solved by dlqr where the control toolbox is there and by lqr_gain.m always; both must agree.
gravity = 9.80665;
period = 1 / 500;

A = zeros(12);
A(1:3, 4:6) = eye(3);
A(4, 8) = -gravity;  % nose up: the thrust, -z of the body, leans backwards
A(5, 7) = gravity;   % right side down: it leans to the right
A(7:9, 10:12) = eye(3);
B = zeros(12, 4);
B(6, 1) = -1 / vehicle.mass;  % thrust lifts: down is positive
B(10:12, 2:4) = diag(1 ./ vehicle.inertia);
held = expm([A, B; zeros(4, 16)] * period);  % zero-order hold
Ad = held(1:12, 1:12);
Bd = held(1:12, 13:16);

e = vehicle.error;
errors = [e.position([1, 1, 2]), e.velocity([1, 1, 2]), e.tilt, e.tilt, e.yaw, ...
          e.rate, e.rate, e.yaw_rate];
Q = diag(1 ./ errors.^2);
R = diag(1 ./ vehicle.control.^2);
K = lqr_gain(Ad, Bd, Q, R);

if exist('OCTAVE_VERSION', 'builtin') ~= 0
  try
    pkg('load', 'control');
  catch
    % Without octave-control there is no dlqr.
  end
end
if exist('dlqr', 'file') ~= 0
  % Measured: 5e-12. The toolbox solves the same equation through eigenvalues.
  difference = max(max(abs(dlqr(Ad, Bd, Q, R) - K))) / max(max(abs(K)));
  fprintf('%s: gains by Riccati recursion; dlqr differs by %.1e\n', vehicle.name, difference);
  if difference > 1e-8
    error('write_gains: dlqr and the Riccati recursion disagree');
  end
else
  fprintf('%s: gains by Riccati recursion; no dlqr here to compare with\n', vehicle.name);
end
K(abs(K) < 1e-9) = 0;  % between channels: rounding

names = {'position_x', 'position_y', 'position_z', 'velocity_x', 'velocity_y', 'velocity_z', ...
         'alpha_x', 'alpha_y', 'alpha_z', 'rate_x', 'rate_y', 'rate_z'};
write_csv(file, made_by, names, {'%.8g'}, K);
end

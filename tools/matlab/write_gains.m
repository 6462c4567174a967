function write_gains(file, made_by, vehicle)
% Linear-quadratic regulators at hover and yaw 0 for the sampled model at the control rate, the whole
% aircraft at once: with the motors' lag and integral action, with the lag, with the integrals, with
% neither; four rows each (thrust, tau_x, tau_y, tau_z), in this order.
% x = [position, velocity, alpha, body rate; integrals; wrench], forward, right, down; the integrals
% and the wrench in the order of the rows: integral of down, right, forward, yaw.
data = zeros(16, 14);
row = 1;
for lag = [1, 0]
  for integral = [1, 0]
    data(row:row + 3, :) = design(vehicle, lag, integral);
    row = row + 4;
  end
end
names = {'position_x', 'position_y', 'position_z', 'velocity_x', 'velocity_y', 'velocity_z', ...
         'alpha_x', 'alpha_y', 'alpha_z', 'rate_x', 'rate_y', 'rate_z', 'lag', 'integral'};
write_csv(file, made_by, names, {'%.8g'}, data);
end

function rows = design(vehicle, lag, integral)
% Twelve gains, that of the row's own wrench and that of its own integral.
[A, B] = hover(vehicle);
if integral
  A = [A, zeros(12, 4); zeros(4, 16)];
  A(13:16, [3, 2, 1, 9]) = eye(4);
  B = [B; zeros(4, 4)];
end
n = size(A, 1);
if lag  % the wrench follows what is asked for
  A = [A, B; zeros(4, n), -eye(4) / vehicle.motor_lag];
  B = [zeros(n, 4); eye(4) / vehicle.motor_lag];
end
size_of = size(A, 1);
held = expm([A, B; zeros(4, size_of + 4)] / 500);  % zero-order hold
Ad = held(1:size_of, 1:size_of);
Bd = held(1:size_of, size_of + 1:end);

w = vehicle.bryson_no_lag;
if lag
  w = vehicle.bryson;
end
errors = w([1, 1, 2, 3, 3, 4, 5, 5, 6, 7, 7, 8]);
if integral
  errors = [errors, w([13, 12, 12, 14])];
end
Q = zeros(size_of);
Q(1:n, 1:n) = diag(1 ./ errors.^2);
R = diag(1 ./ w([9, 10, 10, 11]).^2);
K = lqr_gain(Ad, Bd, Q, R);
compare_with_toolbox(vehicle.name, Ad, Bd, Q, R, K);

rows = zeros(4, 14);
rows(:, 1:12) = K(:, 1:12);
if lag
  rows(:, 13) = diag(K(:, n + 1:n + 4));
end
if integral
  rows(:, 14) = diag(K(:, 13:16));
end
rows(abs(rows) < 1e-8) = 0;  % between channels: rounding
end

function [A, B] = hover(vehicle)
% x' = A x + B u.
gravity = 9.80665;
A = zeros(12);
A(1:3, 4:6) = eye(3);
A(4, 8) = -gravity;  % nose up: the thrust, -z of the body, leans backwards
A(5, 7) = gravity;   % right side down: it leans to the right
A(7:9, 10:12) = eye(3);
B = zeros(12, 4);
B(6, 1) = -1 / vehicle.mass;  % thrust lifts: down is positive
B(10:12, 2:4) = diag(1 ./ vehicle.inertia);
end

function compare_with_toolbox(name, Ad, Bd, Q, R, K)
% dlqr of the control toolbox, where it is there, solves the same equation through eigenvalues.
if exist('OCTAVE_VERSION', 'builtin') ~= 0
  try
    pkg('load', 'control');
  catch
    % Without octave-control there is no dlqr.
  end
end
if exist('dlqr', 'file') ~= 0
  difference = max(max(abs(dlqr(Ad, Bd, Q, R) - K))) / max(max(abs(K)));
  fprintf('%s: gains by doubled Riccati recursion; dlqr differs by %.1e\n', name, difference);
  if difference > 1e-7
    error('write_gains: dlqr and the Riccati recursion disagree');
  end
else
  fprintf('%s: gains by doubled Riccati recursion; no dlqr here to compare with\n', name);
end
end

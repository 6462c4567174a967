function [residual, H, variance, source] = filter_measurements(f, settings, row)
% All that one row of the inputs measures: z - h(x), H and the diagonal of the noise covariance,
% with H at the predicted nominal state. source: 1 tilt, 2 mag, 3 alt, 4 gps for each scalar.
residual = zeros(0, 1);
H = zeros(0, f.states);
variance = zeros(0, 1);
source = zeros(0, 1);
R = rotation_to_body(f.q);

accel = row(2:4)';
if abs(norm(accel) - settings.gravity) < settings.tiltGate
  direction = R * [0; 0; -settings.gravity];
  rows = zeros(3, f.states);
  rows(:, 7:9) = cross_matrix(direction);
  if f.states == 18
    rows(:, 10:12) = eye(3);
  end
  residual = [residual; accel - direction - f.b_a];
  H = [H; rows];
  variance = [variance; settings.tiltSigma^2 * ones(3, 1)];
  source = [source; 1; 1; 1];
end
if row(8) == 1
  direction = R * settings.magReference;
  rows = zeros(3, f.states);
  rows(:, 7:9) = cross_matrix(direction);
  if f.states == 18
    rows(:, 16:18) = eye(3);
  end
  residual = [residual; row(9:11)' - direction - f.b_m];
  H = [H; rows];
  variance = [variance; settings.magSigma^2 * ones(3, 1)];
  source = [source; 2; 2; 2];
end
if row(12) == 1
  rows = zeros(1, f.states);
  rows(3) = 1;  % height = -p_z is measured as p_z = -height
  residual = [residual; -row(13) - f.p(3)];
  H = [H; rows];
  variance = [variance; settings.altSigma^2];
  source = [source; 3];
end
if row(14) == 1
  rows = zeros(4, f.states);
  rows(1:2, 1:2) = eye(2);
  rows(3:4, 4:5) = eye(2);
  residual = [residual; row(15:16)' - f.p(1:2); row(17:18)' - f.v(1:2)];
  H = [H; rows];
  variance = [variance; settings.gpsPositionSigma^2 * [1; 1]; settings.gpsVelocitySigma^2 * [1; 1]];
  source = [source; 4; 4; 4; 4];
end
end

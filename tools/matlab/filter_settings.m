function s = filter_settings(tuning)
% Tuning of the filter under test; `tuning` is a struct of what differs. Names as in
% lib/Navigation/NavigationConfig.h. Noises are those of the simulated sensors, so that the
% covariance can be held against the true error.
% All numbers are rounded to float32, which is what the flight code holds.
s.gravity = 9.80665;                   % m/s^2
s.accelNoise = 0.028 / sqrt(100);      % m/s^2 / sqrt(Hz): DESIGN.md, 5: 0.028 m/s^2 in 100 Hz
s.gyroNoise = 0.0031 / sqrt(100);      % rad/s / sqrt(Hz)
s.accelBiasWalk = 1e-4;                % m/s^2 / sqrt(s)
s.gyroBiasWalk = 1e-5;                 % rad/s / sqrt(s)
s.magBiasWalk = 1e-2;                  % uT / sqrt(s)
s.tiltSigma = 2;                       % m/s^2: mostly the manoeuvres' own acceleration
s.tiltGate = 0.5;                      % m/s^2
s.magSigma = 0.3;                      % uT
s.altSigma = 2 / (1.225 * 9.80665);    % m: 2 Pa
s.gpsPositionSigma = 3;                % m
s.gpsVelocitySigma = 0.3;              % m/s
s.nisGate = 1e30;                      % open
s.positionSigma0 = 0.5;                % m
s.velocitySigma0 = 0.1;                % m/s
s.tiltSigma0 = 0.03;                   % rad
s.headingSigma0 = 0.1;                 % rad
s.accelBiasSigma0 = 0.1;               % m/s^2
s.gyroBiasSigma0 = 0.01;               % rad/s
s.magBiasSigma0 = 2;                   % uT
changed = fieldnames(tuning);
for i = 1:numel(changed)
  s.(changed{i}) = tuning.(changed{i});
end
names = fieldnames(s);
for i = 1:numel(names)
  s.(names{i}) = as_single(s.(names{i}));
end
s.magReference = as_single([16.5; 1.4; 46.2]);  % uT, NED: mid-European field
% Initial attitude, body to NED: roll 5, pitch -8, yaw 130 deg.
half = [5, -8, 130] / 2 * pi / 180;
roll = [cos(half(1)); sin(half(1)); 0; 0];
pitch = [cos(half(2)); 0; sin(half(2)); 0];
yaw = [cos(half(3)); 0; 0; sin(half(3))];
s.attitude0 = as_single(quaternion_product(yaw, quaternion_product(pitch, roll)));
end

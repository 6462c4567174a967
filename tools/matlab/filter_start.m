function f = filter_start(settings, states)
% The filter before its first sample: at rest at the origin with the initial attitude.
% Nominal state p, v, q, b_a, b_g, b_m; error covariance P over dp, dv, alpha and, with 18 states,
% db_a, db_g, db_m. The uncertainty of heading is about the vertical, the other about the level
% axes; alpha is in body axes.
f.states = states;
f.p = zeros(3, 1);
f.v = zeros(3, 1);
f.q = settings.attitude0;
f.b_a = zeros(3, 1);
f.b_g = zeros(3, 1);
f.b_m = zeros(3, 1);
f.reset = zeros(3, 1);
R = rotation_to_body(f.q);
level = diag([settings.tiltSigma0, settings.tiltSigma0, settings.headingSigma0].^2);
f.P = zeros(states);
f.P(1:3, 1:3) = settings.positionSigma0^2 * eye(3);
f.P(4:6, 4:6) = settings.velocitySigma0^2 * eye(3);
f.P(7:9, 7:9) = R * level * R';
if states == 18
  f.P(10:12, 10:12) = settings.accelBiasSigma0^2 * eye(3);
  f.P(13:15, 13:15) = settings.gyroBiasSigma0^2 * eye(3);
  f.P(16:18, 16:18) = settings.magBiasSigma0^2 * eye(3);
end
end

function [nees, attitude_deg] = consistency(out, truth, bias, states)
% How well the filter's covariance tells its true error.
% nees: mean over the flight of e' inv(P) e / states (1 when P is right). attitude_deg: largest
% attitude error in the second half.
total = 0;
attitude_deg = 0;
upper = tril(true(states));
true_bias = [bias.accel; bias.gyro; bias.mag];
rows = size(out.state, 1);
for k = 1:rows
  x = out.state(k, 2:end)';
  P = zeros(states);
  P(upper) = out.covariance(k, 2:end);
  P = P + P' - diag(diag(P));
  alpha = quaternion_log(quaternion_product(quaternion_conjugate(x(7:10)), truth.x(7:10, k)));
  e = [truth.x(1:6, k) - x(1:6); alpha];
  if states == 18
    e = [e; true_bias - x(11:19)]; %#ok<AGROW>
  end
  total = total + e' * (P \ e);
  if truth.t(k) > truth.t(end) / 2
    attitude_deg = max(attitude_deg, norm(alpha) * 180 / pi);
  end
end
nees = total / rows / states;
end

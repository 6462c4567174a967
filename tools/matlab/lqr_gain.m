function K = lqr_gain(A, B, Q, R)
% Gain of u = -K x that makes the sum of x'Qx + u'Ru least for x' = A x + B u: the Riccati recursion
% run until it stands still. Contraction is at least 0.2 % a step (the slowest pole, 0.7 rad/s at
% 500 Hz), so a change below 1e-14 leaves less than 1e-11.
P = Q;
for step = 1:100000
  K = (R + B' * P * B) \ (B' * P * A);
  next = A' * P * (A - B * K) + Q;
  next = (next + next') / 2;
  change = max(max(abs(next - P))) / max(max(abs(next)));
  P = next;
  if change < 1e-14
    return
  end
end
error('lqr_gain: no convergence');
end

function K = lqr_gain(A, B, Q, R)
% Gain of u = -K x that makes the sum of x'Qx + u'Ru least for x' = A x + B u: the Riccati recursion
% P' = Q + A' P (I + B/R B' P)^-1 A from P = Q until it stands still, 2^k of its steps at once
% (B. D. O. Anderson, "Second-order convergent algorithms for the steady-state Riccati equation",
% Int. J. Control 28, 1978).
n = size(A, 1);
Phi = A;
G = B / R * B';
P = Q;
for doubling = 1:60
  M = eye(n) + G * P;
  step = Phi' * P / M * Phi;
  G = G + Phi / M * G * Phi';
  Phi = Phi / M * Phi;
  P = P + (step + step') / 2;
  G = (G + G') / 2;
  if max(max(abs(step))) < 1e-15 * max(max(abs(P)))
    K = (R + B' * P * B) \ (B' * P * A);
    return
  end
end
error('lqr_gain: no convergence');
end

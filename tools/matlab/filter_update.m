function [f, nis, used] = filter_update(f, settings, residual, H, variance)
% Corrects the filter by a set of scalars and injects the error.
% Gate open: one batch with the full matrices, Joseph's form. Gate shut: scalar by scalar, each with
% its residual less H dx of the scalars before; a scalar whose NIS is above the gate does nothing.
n = f.states;
dx = zeros(n, 1);
count = numel(residual);
nis = zeros(count, 1);
used = true(count, 1);
if settings.nisGate >= 1e9
  if count > 0
    S = H * f.P * H' + diag(variance);
    K = f.P * H' / S;
    A = eye(n) - K * H;
    f.P = A * f.P * A' + K * diag(variance) * K';
    dx = K * residual;
  end
else
  for i = 1:count
    h = H(i, :);
    innovation = residual(i) - h * dx;
    s = h * f.P * h' + variance(i);
    nis(i) = innovation^2 / s;
    used(i) = nis(i) <= settings.nisGate;
    if used(i)
      k = f.P * h' / s;
      A = eye(n) - k * h;
      f.P = A * f.P * A' + k * variance(i) * k';
      dx = dx + k * innovation;
    end
  end
end
f.P = (f.P + f.P') / 2;

f.p = f.p + dx(1:3);
f.v = f.v + dx(4:6);
f.q = quaternion_product(f.q, [1; dx(7:9) / 2]);  % local error: on the right
f.q = f.q / norm(f.q);
if n == 18
  f.b_a = f.b_a + dx(10:12);
  f.b_g = f.b_g + dx(13:15);
  f.b_m = f.b_m + dx(16:18);
end
f.reset = f.reset + dx(7:9) / 2;  % for the next prediction
end

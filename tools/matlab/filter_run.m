function out = filter_run(settings, states, inputs)
% The filter over a whole flight. After each row: nominal state, packed P, and what was rejected.
%   state       t_us, p, v, q and, with 18 states, b_a, b_g, b_m
%   covariance  t_us and the upper triangle of P row by row
%   rejected    t_us and a bit mask for each of tilt, mag, alt, gps: bit i, the i-th scalar
% It stops where float32 could decide otherwise than this: too near to a gate.
rows = size(inputs, 1);
upper = tril(true(states));  % of P', column by column: P row by row
f = filter_start(settings, states);
width = 11 + (states - 9);
out.state = zeros(rows, width);
out.covariance = zeros(rows, 1 + states * (states + 1) / 2);
out.rejected = zeros(rows, 5);
out.tilts = 0;
for k = 1:rows
  row = inputs(k, :);
  if k > 1  % the first row only starts the clock
    dt = (row(1) - inputs(k - 1, 1)) * 1e-6;
    f = filter_predict(f, settings, row(2:4)', row(5:7)', dt);
    if abs(abs(norm(row(2:4)) - settings.gravity) - settings.tiltGate) < 1e-4
      error('filter_run: row %d is too near to the tilt gate, choose another seed', k);
    end
    [residual, H, variance, source] = filter_measurements(f, settings, row);
    [f, nis, used] = filter_update(f, settings, residual, H, variance);
    if any(abs(nis / settings.nisGate - 1) < 1e-3)
      error('filter_run: row %d is too near to the NIS gate, choose another seed', k);
    end
    out.tilts = out.tilts + any(source == 1);
    for s = 1:4
      refused = ~used(source == s);
      out.rejected(k, 1 + s) = sum(2.^(find(refused) - 1));
    end
  end
  x = [f.p; f.v; f.q];
  if states == 18
    x = [x; f.b_a; f.b_g; f.b_m]; %#ok<AGROW>
  end
  out.state(k, :) = [row(1), x'];
  transposed = f.P';
  out.covariance(k, :) = [row(1), transposed(upper)'];
  out.rejected(k, 1) = row(1);
end
end

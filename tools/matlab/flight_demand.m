function [acceleration, rate, rate_change] = flight_demand(flight, t)
% What the flight asks for at the times t (s, row), one column each: acceleration in NED, m/s^2;
% body rate, rad/s; its derivative, rad/s^2.
acceleration = zeros(3, numel(t));
rate = zeros(3, numel(t));
rate_change = zeros(3, numel(t));
for i = 1:size(flight.pushes, 1)
  push = flight.pushes(i, :);
  phase = min(max((t - push(2)) / push(3), 0), 1);
  acceleration(push(1), :) = acceleration(push(1), :) + push(4) * sin(2 * pi * phase);
end
for i = 1:size(flight.turns, 1)
  turn = flight.turns(i, :);
  phase = 2 * pi * min(max((t - turn(2)) / turn(3), 0), 1);
  mean_rate = turn(4) / turn(3);
  rate(turn(1), :) = rate(turn(1), :) + mean_rate * (1 - cos(phase));
  rate_change(turn(1), :) = rate_change(turn(1), :) + mean_rate * 2 * pi / turn(3) * sin(phase);
end
end

function truth = simulate_truth(flight, start, body)
% Integrates the rigid body through the flight (Runge and Kutta, 4th order, `substeps` a sample).
% The actuators are ideal: they give the demanded acceleration (as a force in NED) and the torque
% that the demanded rate needs. Nothing holds the body on the demanded path: it is integrated.
% start: x of body_derivative.m. Result: t (s, row) and x, one column a sample of the IMU.
samples = round(flight.duration * flight.rate) + 1;
h = 1 / flight.rate / flight.substeps;
truth.t = (0:samples - 1) / flight.rate;
truth.x = zeros(13, samples);
truth.x(:, 1) = start;

% The demand at the start, middle and end of every step.
steps = (samples - 1) * flight.substeps;
[acceleration, rate, rate_change] = flight_demand(flight, (0:2 * steps) * h / 2);
force = body.mass * (acceleration - [0; 0; body.gravity]);  % NED
momentum = body.inertia * rate;
torque = body.inertia * rate_change + cross(rate, momentum);

x = start;
for step = 1:steps
  a = 2 * step - 1;
  m = a + 1;
  b = a + 2;
  k1 = body_derivative(x, force(:, a), torque(:, a), body);
  k2 = body_derivative(x + h / 2 * k1, force(:, m), torque(:, m), body);
  k3 = body_derivative(x + h / 2 * k2, force(:, m), torque(:, m), body);
  k4 = body_derivative(x + h * k3, force(:, b), torque(:, b), body);
  x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  x(7:10) = x(7:10) / norm(x(7:10));
  if mod(step, flight.substeps) == 0
    truth.x(:, 1 + step / flight.substeps) = x;
  end
end
end

function inputs = measure(flight, truth, noise, bias, settings)
% What the sensors say: columns as in inputs_columns.m, one row a sample, rounded to float32.
%
% The IMU integrates: a sample is the mean over the period that it ends. The increments are resolved
% in the axes at the period's start (coning and sculling are taken out, as good IMUs do), so that
% the filter's equations with the true biases repeat the true motion and what is left is noise.
% White noise of density d has the standard deviation d / sqrt(period) in such a mean.
% noise: densities of accel and gyro, standard deviations of mag, alt, gps_position, gps_velocity.
% bias: accel, gyro, mag; constant.
n = numel(truth.t);
dt = 1 / flight.rate;
[random, ~] = random_normal(flight.seed, n, 14);
inputs = zeros(n, 18);
inputs(:, 1) = flight.start_us + round(1e6 * truth.t');
for k = 1:n
  % The first row only starts the filter's clock: its sample ends no period.
  if k == 1
    accel = rotation_to_body(truth.x(7:10, 1)) * [0; 0; -settings.gravity];
    gyro = truth.x(11:13, 1);
  else
    before = truth.x(:, k - 1);
    now = truth.x(:, k);
    change = (now(4:6) - before(4:6)) / dt - [0; 0; settings.gravity];
    accel = rotation_to_body(before(7:10)) * change;
    turned = quaternion_product(quaternion_conjugate(before(7:10)), now(7:10));
    gyro = quaternion_log(turned) / dt;
  end
  accel = accel + bias.accel + noise.accel / sqrt(dt) * random(k, 1:3)';
  gyro = gyro + bias.gyro + noise.gyro / sqrt(dt) * random(k, 4:6)';
  inputs(k, 2:7) = [accel', gyro'];
  if k == 1
    continue
  end
  position = truth.x(1:3, k);
  velocity = truth.x(4:6, k);
  if mod(k - 1, flight.every.mag) == 0
    field = rotation_to_body(truth.x(7:10, k)) * settings.magReference;
    inputs(k, 8:11) = [1, (field + bias.mag + noise.mag * random(k, 7:9)')'];
  end
  if mod(k - 1, flight.every.alt) == 0
    inputs(k, 12:13) = [1, -position(3) + noise.alt * random(k, 10)];
  end
  if mod(k - 1, flight.every.gps) == 0
    fix = position(1:2)' + noise.gps_position * random(k, 11:12);
    inputs(k, 14:18) = [1, fix, velocity(1:2)' + noise.gps_velocity * random(k, 13:14)];
  end
end
first = [8, 12, 14];  % due flags of mag, alt, gps; their components follow
for i = 1:size(flight.outliers, 1)
  outlier = flight.outliers(i, :);
  row = round(outlier(1) * flight.rate) + 1;
  flag = first(outlier(2));
  if inputs(row, flag) ~= 1
    error('measure: outlier %d is where nothing is measured', i);
  end
  inputs(row, flag + outlier(3)) = inputs(row, flag + outlier(3)) + outlier(4);
end
inputs(:, 2:end) = as_single(inputs(:, 2:end));
end

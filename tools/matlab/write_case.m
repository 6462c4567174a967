function write_case(folder, made_by, flight, body)
% Simulates one flight, runs both filters on it and writes config.csv, inputs.csv and, for each
% filter, state, covariance and rejected components.
settings = filter_settings(flight.tuning);
bias.accel = as_single([0.08; -0.05; 0.06]);    % m/s^2
bias.gyro = as_single([0.006; -0.004; 0.005]);  % rad/s
bias.mag = as_single([1.2; -0.8; 1.5]);         % uT
noise.accel = settings.accelNoise;
noise.gyro = settings.gyroNoise;
noise.mag = settings.magSigma;
noise.alt = settings.altSigma;
noise.gps_position = settings.gpsPositionSigma;
noise.gps_velocity = settings.gpsVelocitySigma;

% The truth starts where the filter's initial covariance says that it may.
[random, ~] = random_normal(flight.seed + 1, 9, 1);
first = filter_start(settings, 9);
offset = chol(first.P)' * random;
q = quaternion_product(first.q, quaternion_exp(offset(7:9)));
[~, rate] = flight_demand(flight, 0);
truth = simulate_truth(flight, [offset(1:6); q / norm(q); rate], body);
inputs = measure(flight, truth, noise, bias, settings);
check_flight(flight, truth, settings);

if exist(folder, 'dir') ~= 7
  mkdir(folder);
end
write_config(fullfile(folder, 'config.csv'), made_by, settings);
inputs_formats = [{'%.0f'}, repmat({'%.9g'}, 1, 17)];
write_csv(fullfile(folder, 'inputs.csv'), made_by, inputs_columns(), inputs_formats, inputs);
names = {'t_us', 'p_n', 'p_e', 'p_d', 'v_n', 'v_e', 'v_d', 'q_w', 'q_x', 'q_y', 'q_z', ...
         'ba_x', 'ba_y', 'ba_z', 'bg_x', 'bg_y', 'bg_z', 'bm_x', 'bm_y', 'bm_z'};
for states = [9, 18]
  out = filter_run(settings, states, inputs);
  columns = 11 + states - 9;
  which = sprintf('_%d.csv', states);
  write_csv(fullfile(folder, ['state', which]), made_by, names(1:columns), ...
            [{'%.0f'}, repmat({'%.10g'}, 1, columns - 1)], out.state);
  packed = packed_names(states);
  write_csv(fullfile(folder, ['covariance', which]), made_by, [{'t_us'}, packed], ...
            [{'%.0f'}, repmat({'%.7g'}, 1, numel(packed))], ...
            out.covariance(1:flight.covariance_every:end, :));
  if settings.nisGate < 1e9
    write_csv(fullfile(folder, ['rejected', which]), made_by, ...
              {'t_us', 'tilt', 'mag', 'alt', 'gps'}, {'%.0f'}, out.rejected);
    if ~all(any(out.rejected(:, 2:5) > 0))
      error('write_case: %s: a sensor was never rejected', flight.name);
    end
  end
  if out.tilts == 0
    error('write_case: %s: tilt was never used', flight.name);
  end
  fprintf('%s, %d states: tilt used in %d of %d rows\n', flight.name, states, out.tilts, ...
          size(inputs, 1));
  if states == 18 && settings.nisGate >= 1e9
    report_consistency(flight, out, truth, bias, states);
  end
end

if settings.nisGate < 1e9
  return  % with errors that the noise model does not know no covariance can be right
end
% The 9-state filter knows no biases: its covariance is right only where there are none.
none = struct('accel', zeros(3, 1), 'gyro', zeros(3, 1), 'mag', zeros(3, 1));
out = filter_run(settings, 9, measure(flight, truth, noise, none, settings));
report_consistency(flight, out, truth, none, 9);
end

function report_consistency(flight, out, truth, bias, states)
[nees, attitude_deg] = consistency(out, truth, bias, states);
fprintf('%s, %d states: mean NEES / states %.2f, largest attitude error %.2f deg\n', ...
        flight.name, states, nees, attitude_deg);
% One flight's mean NEES spreads widely, since errors last for seconds. A wrong sign gives 100s.
if nees < 0.3 || nees > 3
  error('write_case: %s: the covariance does not tell the true error', flight.name);
end
end

function check_flight(flight, truth, settings)
% What the flight is made for. Cosine of the tilt: -1 on the back.
cosine = 1 - 2 * (truth.x(8, :).^2 + truth.x(9, :).^2);
inverted = sum(cosine < -0.9) / flight.rate;
rates = max(abs(truth.x(11:13, :)), [], 2);
speed = max(sqrt(sum(truth.x(4:6, :).^2)));
fprintf('%s: %.1f s on the back, rates to %.1f %.1f %.1f rad/s, speed to %.1f m/s\n', ...
        flight.name, inverted, rates, speed);
if strcmp(flight.name, 'flight')
  turned = zeros(3, 1);
  for i = 1:3
    turned(i) = max(abs(flight.turns(flight.turns(:, 1) == i, 4)));
  end
  if any(turned < 2 * pi) || inverted < 5 || flight.duration < 60
    error('write_case: the flight is not the one that is asked for');
  end
end
if settings.gravity < 9 || any(~isfinite(truth.x(:)))
  error('write_case: %s: the simulation failed', flight.name);
end
end

function names = packed_names(states)
names = cell(1, 0);
for i = 0:states - 1
  for j = i:states - 1
    names{end + 1} = sprintf('P_%d_%d', i, j); %#ok<AGROW>
  end
end
end

function write_config(file, made_by, settings)
% One row a number: name,value. Vectors have one row a component.
handle = fopen(file, 'w');
if handle < 0
  error('write_config: cannot write %s', file);
end
fprintf(handle, '# %s\nname,value\n', made_by);
names = fieldnames(settings);
for i = 1:numel(names)
  value = settings.(names{i});
  switch numel(value)
    case 1
      components = {''};
    case 3
      components = {'.n', '.e', '.d'};
    otherwise
      components = {'.w', '.x', '.y', '.z'};
  end
  for c = 1:numel(value)
    fprintf(handle, '%s%s,%.9g\n', names{i}, components{c}, value(c));
  end
end
fclose(handle);
end

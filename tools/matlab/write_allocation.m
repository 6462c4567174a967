function write_allocation(file, made_by, vehicle, seed)
% Wrench, squared rotor speeds and ESC commands, within the limits, where the answer is one.
% effect: wrench [thrust; tau_x; tau_y; tau_z] of squared speeds, from DESIGN.md's table of signs.
effect = [vehicle.kT * ones(1, 4)
          vehicle.arm * vehicle.kT * vehicle.roll
          vehicle.arm * vehicle.kT * vehicle.pitch
          vehicle.kM * vehicle.yaw];
% Trust the physics over the table: the thrust of a rotor at r is -z, its moment r x F.
for i = 1:4
  moment = cross([vehicle.x(i); vehicle.y(i); 0], [0; 0; -vehicle.kT]);
  if max(abs(moment(1:2) - effect(2:3, i))) > 1e-15
    error('write_allocation: %s, M%d: the table disagrees with r x F', vehicle.name, i);
  end
end
inverse = pinv(effect);

% Speeds anywhere within the limits, 2 % inside, give wrenches that can be met exactly. First hover.
rows = 100;
uniform = zeros(rows, 4);
state = seed;
for i = 1:numel(uniform)
  state = mod(16807 * state, 2147483647);
  uniform(i) = state / 2147483647;
end
n = vehicle.n_min + (vehicle.n_max - vehicle.n_min) * (0.02 + 0.96 * uniform);
wrench = (effect * (n.^2)')';
wrench(1, :) = [vehicle.mass * 9.80665, 0, 0, 0];
wrench = as_single(wrench);
squares = (inverse * wrench')';
speeds = sqrt(squares);
command = vehicle.command(1) + vehicle.command(2) * speeds + vehicle.command(3) * squares;
names = {'thrust', 'tau_x', 'tau_y', 'tau_z', 'n2_1', 'n2_2', 'n2_3', 'n2_4', ...
         'command_1', 'command_2', 'command_3', 'command_4'};
write_csv(file, made_by, names, {'%.9g'}, [wrench, squares, command]);
end

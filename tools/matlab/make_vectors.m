function make_vectors(folder)
% Writes sim_vectors/ anew: flights with both filters' states and covariances, gains, allocation.
%   MATLAB:  matlab -batch "addpath('tools/matlab'); make_vectors('sim_vectors')"
%   Octave:  octave-cli --path tools/matlab --eval "make_vectors('sim_vectors')"
% or, whichever is there, `make vectors`. Seeds and the date are constants, so that the same files
% come out again. Written from the equations in DESIGN.md and Sola (arXiv 1711.02508), not from C++.
%   truth      flight_case, flight_demand -> simulate_truth, body_derivative -> measure
%   filter     filter_settings, filter_start -> filter_run: filter_predict, filter_measurements,
%              filter_update -> consistency, which holds it against the truth
%   aircraft   vehicle_numbers -> write_gains, write_allocation
made_on = '2026-11-22';
folder_of(folder);
names = {'flight', 'fast', 'gate'};
for i = 1:numel(names)
  flight = flight_case(names{i});
  made_by = sprintf('tools/matlab/make_vectors.m, seed %d, %s', flight.seed, made_on);
  write_case(folder_of(fullfile(folder, flight.name)), made_by, flight, quad_body());
end

made_by = sprintf('tools/matlab/make_vectors.m, no seed, %s', made_on);
vehicles = vehicle_numbers();
gains = folder_of(fullfile(folder, 'gains'));
for i = 1:numel(vehicles)
  write_gains(fullfile(gains, [vehicles(i).name, '.csv']), made_by, vehicles(i));
end
seed = 20201;
made_by = sprintf('tools/matlab/make_vectors.m, seed %d, %s', seed, made_on);
allocation = folder_of(fullfile(folder, 'allocation'));
for i = 1:numel(vehicles)
  file = fullfile(allocation, [vehicles(i).name, '.csv']);
  write_allocation(file, made_by, vehicles(i), seed + i);
end
end

function body = quad_body()
% The rigid body that flies: Quad5in (DESIGN.md, 5).
vehicles = vehicle_numbers();
body.mass = vehicles(1).mass;
body.inertia = diag(vehicles(1).inertia);
body.gravity = as_single(9.80665);
end

function folder = folder_of(folder)
% The folder, made if it is not there.
if exist(folder, 'dir') ~= 7
  mkdir(folder);
end
end

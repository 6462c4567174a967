function [x, state] = random_normal(state, rows, columns)
% Standard normal numbers that are the same in MATLAB, in Octave and on every machine.
% Park and Miller's generator, s' = 16807 s mod (2^31 - 1): every product is below 2^46, so it is
% exact in double precision. Box and Muller make two normal numbers of two uniform ones.
% state: seed, 1 .. 2^31 - 2; the second output is the seed for the next call.
modulus = 2147483647;
pairs = ceil(rows * columns / 2);
uniform = zeros(pairs, 2);
for i = 1:pairs
  state = mod(16807 * state, modulus);
  uniform(i, 1) = state / modulus;
  state = mod(16807 * state, modulus);
  uniform(i, 2) = state / modulus;
end
radius = sqrt(-2 * log(uniform(:, 1)));
angle = 2 * pi * uniform(:, 2);
x = [radius .* cos(angle); radius .* sin(angle)];
x = reshape(x(1:rows * columns), rows, columns);
end

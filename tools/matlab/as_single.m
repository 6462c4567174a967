function x = as_single(x)
% Rounds to what float32 holds: the flight code and this reference must see the same numbers.
x = double(single(x));
end

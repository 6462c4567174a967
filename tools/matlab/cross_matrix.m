function s = cross_matrix(a)
% cross_matrix(a) * b is cross(a, b). Sola (2017), eq. 73.
s = [0, -a(3), a(2); a(3), 0, -a(1); -a(2), a(1), 0];
end

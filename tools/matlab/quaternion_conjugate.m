function r = quaternion_conjugate(q)
% The inverse rotation of a unit quaternion [w; x; y; z].
r = [q(1); -q(2:4)];
end

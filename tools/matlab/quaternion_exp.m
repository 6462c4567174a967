function q = quaternion_exp(v)
% Rotation vector, rad, to unit quaternion [w; x; y; z]. Sola (2017), eq. 101.
angle = norm(v);
if angle == 0
  q = [1; 0; 0; 0];
else
  q = [cos(angle / 2); sin(angle / 2) * v / angle];
end
end

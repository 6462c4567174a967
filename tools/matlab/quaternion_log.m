function v = quaternion_log(q)
% Unit quaternion to rotation vector, rad, the short way round. Sola (2017), eq. 105.
if q(1) < 0
  q = -q;
end
sine = norm(q(2:4));
if sine == 0
  v = zeros(3, 1);
else
  v = 2 * atan2(sine, q(1)) * q(2:4) / sine;
end
end

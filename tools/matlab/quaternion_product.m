function r = quaternion_product(p, q)
% Hamilton product p (x) q of columns [w; x; y; z]. Sola (2017), eq. 13.
pv = p(2:4);
qv = q(2:4);
r = [p(1) * q(1) - pv' * qv; p(1) * qv + q(1) * pv + cross_matrix(pv) * qv];
end

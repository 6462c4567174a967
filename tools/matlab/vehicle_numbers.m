function vehicles = vehicle_numbers()
% Both aircraft: DESIGN.md, 5, and for the regulator's weights include/vehicles/*.h.
% Signs of roll, pitch and yaw torque per motor M1..M4 are those of DESIGN.md's table, which
% write_allocation checks against where the motors stand. x forward, y right of the centre of mass,
% m. n is in rev/s (Quad5in) or rad/s (UgglanQ450); command = offset + linear n + quadratic n^2.
% Largest acceptable values (Bryson), for designs that know the motors' lag and for those that do
% not: position and velocity, each horizontal and down, tilt, yaw, rate, yaw rate (m, m/s, rad,
% rad/s); thrust, tilt torque, yaw torque (N, N m); integrals of position, horizontal and down, and
% of yaw (m s, rad s).
quad.name = 'Quad5in';
quad.mass = 0.83;                      % kg
quad.inertia = [0.003, 0.004, 0.005];  % kg m^2
quad.arm = 0.08;                       % m, to the roll and to the pitch axis
quad.x = 0.08 * [1, 1, -1, -1];
quad.y = 0.08 * [-1, 1, 1, -1];
quad.roll = [1, -1, -1, 1];
quad.pitch = [1, 1, -1, -1];
quad.yaw = [-1, 1, -1, 1];
quad.kT = 6.583e-5;                    % N / (rev/s)^2
quad.kM = 7.51e-7;                     % N m / (rev/s)^2
quad.command = [1195, 0, 755 / 160000];  % us
quad.n_min = 60;
quad.n_max = sqrt((1700 - 1195) / 755 * 160000);  % flight cap 1700 us
quad.motor_lag = 0.04;                 % s
quad.bryson = [1.5, 0.7, 1.0, 1.0, 0.15, 0.25, 1.25, 1.0, 2.0, 0.085, 0.02, 1.0, 0.7, 1.2];
quad.bryson_no_lag = [1.0, 1.0, 1.3, 1.0, 0.5, 0.3, 0.4, 0.6, 2.0, 0.01, 0.02, 2.0, 2.0, 0.7];

ugglan.name = 'UgglanQ450';
ugglan.mass = 1.058;
ugglan.inertia = [0.014, 0.014, 0.026];
ugglan.arm = 0.163;
ugglan.x = 0.163 * [1, -1, -1, 1];
ugglan.y = 0.163 * [1, 1, -1, -1];
ugglan.roll = [-1, -1, 1, 1];
ugglan.pitch = [1, -1, -1, 1];
ugglan.yaw = [-1, 1, -1, 1];
ugglan.kT = 8.37e-6;                   % N / (rad/s)^2
ugglan.kM = 8.37e-6 / 50;              % N m / (rad/s)^2
ugglan.command = [-9675, 57, 0];       % int16
ugglan.n_min = 220;
ugglan.n_max = (31000 + 9675) / 57;    % flight cap 31000
ugglan.motor_lag = 0.08;
ugglan.bryson = [2.5, 0.7, 1.5, 1.0, 0.3, 0.25, 0.8, 0.7, 2.0, 0.13, 0.03, 2.5, 0.7, 1.5];
ugglan.bryson_no_lag = [2.5, 1.0, 1.6, 1.0, 0.5, 0.3, 0.2, 0.4, 2.0, 0.008, 0.05, 5.0, 2.0, 0.7];

vehicles = [quad, ugglan];
end

function flight = flight_case(name)
% The flights that the vectors are made of.
%   turns   one row a turn: body axis, start (s), duration (s), angle (rad). The rate is a raised
%           cosine, so it starts and ends smoothly; turns may overlap.
%   pushes  one row a push: NED axis, start (s), duration (s), amplitude (m/s^2). The acceleration
%           is one period of a sine, so it leaves no velocity behind.
% The seeds were chosen so that no sample falls so near to a gate that float32 could decide
% otherwise (filter_run.m stops there).
flight.name = name;
flight.start_us = 1000000;
flight.outliers = zeros(0, 4);  % time (s), sensor (1 mag, 2 alt, 3 gps), component, added error
flight.covariance_every = 1;  % rows: one covariance is written for so many
flight.tuning = struct();  % what differs from filter_settings.m
switch name
  case 'flight'
    % A minute: a full turn about each axis, 6 s on the back, a tumble about all three.
    flight.seed = 20176;
    flight.duration = 60;
    flight.rate = 50;
    flight.every = struct('mag', 2, 'alt', 5, 'gps', 10);  % samples of the IMU
    flight.substeps = 4;
    flight.turns = [
        1,  6, 4, 2 * pi
        2, 14, 4, 2 * pi
        3, 22, 4, 2 * pi
        1, 30, 2, pi
        1, 38, 2, pi
        1, 44, 5, 2 * pi
        2, 44, 5, -2 * pi
        3, 44, 5, 2 * pi
        2, 52, 3, -2 * pi
        1,  2, 2, 0.4
        2,  3, 3, -0.3
        3,  1, 3, 0.6
        2, 11, 3, 0.5
        1, 11, 3, -0.4
        1, 19, 3, -0.6
        2, 27, 3, -0.1
        1, 27, 3, 0.6
        3, 33, 4, 0.8
        2, 33, 4, 0.2
        3, 41, 3, -0.7
        1, 56, 3, 0.5];
    flight.pushes = [
        1,  4, 4, 4.0
        2,  9, 4, -3.5
        3, 12, 4, 3.0
        1, 17, 4, -4.0
        2, 20, 4, 3.5
        3, 25, 4, -3.0
        1, 28, 6, 2.0
        2, 33, 4, 4.0
        1, 40, 4, 5.0
        3, 42, 4, -4.0
        2, 47, 4, -4.0
        1, 50, 6, -5.0
        3, 54, 4, 4.0];
  case 'fast'
    % Two seconds at the aircraft's own rates, up to 19 rad/s.
    flight.seed = 20182;
    flight.duration = 2;
    flight.rate = 1000;
    flight.every = struct('mag', 10, 'alt', 20, 'gps', 100);
    flight.substeps = 2;
    flight.covariance_every = 10;
    flight.tuning.tiltSigma = 9;  % as much information a second as 2 m/s^2 at 50 Hz
    flight.turns = [
        1, 0.1, 0.8, 2 * pi
        2, 0.5, 1.0, -2 * pi
        3, 0.9, 1.0, 3 * pi];
    flight.pushes = [
        1, 0.0, 1.0, 8.0
        2, 0.3, 1.2, -6.0
        3, 1.0, 1.0, 7.0];
  case 'gate'
    % Six seconds with the chi-square gate shut on gross errors of single components.
    flight.seed = 20193;
    flight.duration = 6;
    flight.rate = 50;
    flight.every = struct('mag', 2, 'alt', 5, 'gps', 10);
    flight.substeps = 4;
    flight.tuning.nisGate = 6.635;  % chi-square, 1 degree of freedom, 99 %
    flight.tuning.tiltSigma = 1;    % small enough that pushes are refused, too
    flight.tuning.magSigma = 1.5;   % the 9-state filter has no magnetic bias to follow
    flight.turns = [
        3, 0.5, 2.0, pi
        1, 1.5, 2.0, 1.0
        2, 3.0, 2.0, -1.2];
    flight.pushes = [
        1, 0.2, 2.0, 3.0
        2, 1.0, 3.0, -2.5
        3, 3.5, 2.0, 2.0];
    mag = 1;
    alt = 2;
    gps = 3;
    flight.outliers = [
        1.0, mag, 2, 60
        1.4, mag, 1, -35
        1.4, mag, 3, 45
        2.0, alt, 1, 40
        2.0, gps, 2, -90
        2.4, gps, 4, 12
        3.2, gps, 1, 120
        3.2, gps, 3, -9
        3.2, mag, 1, 50
        4.0, alt, 1, -25
        4.0, mag, 3, -70
        5.0, gps, 1, -80
        5.0, gps, 2, 80
        5.0, gps, 3, 15
        5.0, gps, 4, -15];
  otherwise
    error('flight_case: no flight named %s', name);
end
end

"""Finds true north with a gyro and an accelerometer on an indexing turntable.

This page fixes the conventions; every other module keeps them.

Frames (one letter; a leading ``C`` is a rotation matrix, ``v_t = C_n_t @ v_n``):
    n  local geographic: East, North, Up
    t  the table at index angle zero: z_t the rotation axis, up; y_t the index mark, whose
       azimuth is sought; x_t completes the right hand
    b  the sensing axis: y_b = cos(T) y_t - sin(T) x_t at table angle T

Signs:
    azimuth phi     clockwise from true north to the horizontal projection of y_t, [0, 2 pi)
    table angle T   counter-clockwise seen from above
    pitch theta     elevation of y_t, positive up
    roll gamma      positive lifts -x_t: sin(elevation of -x_t) = sin(gamma) cos(theta)
    epsilon, zeta   tilt of the table plane, and the table angle of its downhill direction
    latitude L      geodetic, positive north
    C_n_t           R_y(gamma) R_x(theta) R_z(phi)
    specific force  +g on an axis that points up

Signal: a sensor mounted at angle mu from the index mark, counter-clockwise, reads at T = T_i + mu
    y_i = R + a cos T + b sin T + noise, with R its bias and
    gyro            a = Y_t, b = -X_t of the Earth's rate omega_n = Omega_e (0, cos L, sin L)
    accelerometer   a = g sin(theta), b = g sin(gamma) cos(theta)

Units: rad, rad/s, s, m inside; every dimensional name carries its unit (``azimuth_rad``).
Specific force is in g: standard gravities from an instrument, local gravities where a function
says so. Degrees appear only at the edges: wire, configuration, JSON, terminal, web.
"""

"""The vehicle's motion: rigid body, thrusters and guided autopilot, stepped on a fixed grid by one
compiled loop.

One row of the track holds everything that the next step needs. Attitude is a quaternion (Fossen,
Handbook of Marine Craft Hydrodynamics and Motion Control, 2.2.2): no trigonometry in the loop, and
no singularity for a vehicle that tumbles. The other numbers after "Handbook" are sections or
equations of that book.
"""

import math

import numpy as np

from suave_des.compiling import Array, IntArray, compiled

# Columns of the track; the world frame has x east, y north, z up.
POSITION = slice(0, 3)  # p, world frame, m
ATTITUDE = slice(3, 7)  # unit quaternion (w, x, y, z), body to world
VELOCITY = slice(7, 13)  # nu, body frame, m/s and rad/s
VELOCITY_INTEGRAL = slice(13, 16)  # of the velocity error, world frame, as an acceleration, m/s^2
HEADING_INTEGRAL = 16  # of the heading error, as an angular acceleration, rad/s^2
LEG_START = slice(17, 20)  # of the leg that the autopilot flies, world frame, m
LEG_END = slice(20, 23)  # the set-point, world frame, m
LEG_TIME = 23  # since the leg began, s
LEG_QUARTER = 24  # a quarter of the leg's duration, s
SET_POINT_NUMBER = 25  # of the set-point that the leg leads to; the one at the start is number 0
COLUMNS = 26

# Places in the set-point vector, after x, y and z of its position, world frame, m.
HALF_HEADING_COS, HALF_HEADING_SIN = 3, 4  # cosine and sine of half the heading
NUMBER = 5  # how many set-points were given before

# Places in the parameter vector, see `autopilot.kernel_parameters`.
MASS = 0  # kg
IXX, IYY, IZZ = 1, 2, 3  # principal moments of inertia, kg m^2
NET_BUOYANCY = 4  # buoyancy less weight, N
RIGHTING = 5  # buoyancy times its height above the centre of mass, N m
DRAG = 6  # six coefficients of -c |nu| nu, each divided by its mass or moment of inertia, 1/m and 1/rad
POSITION_GAIN, POSITION_GAIN_Z = 12, 13  # velocity for a position error, 1/s
JERK = 14  # of a leg, m/s^3
VELOCITY_GAIN, VELOCITY_INTEGRAL_GAIN = (
    15,
    16,
)  # acceleration for a horizontal velocity error, 1/s; its integral, 1/s^2
VELOCITY_GAIN_Z, VELOCITY_INTEGRAL_GAIN_Z = 17, 18  # the same for a vertical one
INTEGRAL_LIMIT = 19  # of each velocity integral, m/s^2
ROLL_GAIN, ROLL_RATE_GAIN = (
    20,
    21,
)  # angular acceleration for a roll error, 1/s^2, and for its rate, 1/s
HEADING_GAIN, HEADING_RATE_GAIN = 22, 23  # the same for the heading
HEADING_INTEGRAL_GAIN = 24  # 1/s^3
HEADING_INTEGRAL_LIMIT = 25  # rad/s^2
CURRENT = 26  # constant velocity of the water, world frame, three components, m/s
FLOOR, CEILING = 29, 30  # z of sea bed and surface, m
WAVE_X, WAVE_Y = 31, 32  # amplitude of the varying part of the current, east and north, m/s
WAVE_RATE, WAVE_PHASE = 33, 34  # its angle per row and at row 0, rad

# Columns of the thrusters' array: what each can give, equal for one that has failed, and gave in
# the last step, N.
LEAST, GREATEST, LAST = 0, 1, 2

ARRIVED_M = 2.0
"""ArduPilot's WPNAV_RADIUS: a leg is complete when its time is over and the vehicle is this near to
its end.
"""

# Columns of a course: a timer's start and period, s; half the width and height of the box around a
# way-point in which it counts as reached, m; ticks from sending it to its first check, to sending
# it again, and again; what is added to x and y in its set-point, and the set-point's z, m; the next
# tick that checks it, the one that sends it again, the last to look at; its row, the first, the one
# after the last; how many set-points can be sent; time between rows, s.
START, PERIOD, HALF_WIDTH, HALF_HEIGHT, FEWEST, MOST, MOST_AGAIN = range(7)
SENT_X, SENT_Y, SENT_Z, TICK, AGAIN, UNTIL, PLACE, FIRST, END, ROOM, GRID = range(7, 18)

UNCHECKED = (0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 1.0, 1.0), -1
"""A box, a timer and a tick before row 0, for `advance` without checks."""
Dynamics = tuple[float, Array, Array, Array, Array, Array]
"""What moves the vehicle, besides its state:

- the time between rows, as the simulated world counts it, s;
- set-point: position, heading and number, shape (6,);
- parameters: constants, shape (35,);
- allocation: thrusts for a demanded wrench, shape (6 thrusters, 6), in Fortran's order;
- wrenches: wrench for thrusts, shape (6, 6 thrusters), in Fortran's order;
- thrusters: what each can give and gave last, shape (6 thrusters, 3), in Fortran's order.
"""


@compiled
def clamp(value: float, limit: float) -> float:
    """Limit a value to -limit .. limit; a little quicker here than min and max."""
    return -limit if value < -limit else limit if value > limit else value


@compiled
def begin_leg(track: Array, row: int, prm: Array) -> tuple[float, float, float, float, float]:
    """Begin the leg to a new set-point, as ArduPilot's waypoint controller does (AC_WPNav,
    set_wp_destination).

    If the leg before is completed, the new one starts at its end. If not, the controller starts
    from the stopping point of the vehicle, without the integral that it had built up.

    Returns:
        Where the leg starts, x, y and z in m; the integral in x and y.
    """
    x, y, z = track[row, 0], track[row, 1], track[row, 2]
    to_x, to_y, to_z = track[row, 20], track[row, 21], track[row, 22]
    is_over = track[row, LEG_TIME] >= 4.0 * track[row, LEG_QUARTER]
    if is_over and (to_x - x) ** 2 + (to_y - y) ** 2 + (to_z - z) ** 2 <= ARRIVED_M * ARRIVED_M:
        return to_x, to_y, to_z, track[row, 13], track[row, 14]
    qw, qx, qy, qz = track[row, 3], track[row, 4], track[row, 5], track[row, 6]
    u, v, w = track[row, 7], track[row, 8], track[row, 9]
    # R nu as q nu q*: nu + 2 qw (e x nu) + 2 e x (e x nu), with the vector part e of q (Handbook,
    # 2.2.2).
    cx, cy, cz = qy * w - qz * v, qz * u - qx * w, qx * v - qy * u
    wx = u + 2.0 * (qw * cx + qy * cz - qz * cy)
    wy = v + 2.0 * (qw * cy + qz * cx - qx * cz)
    wz = w + 2.0 * (qw * cz + qx * cy - qy * cx)
    from_x, from_y = x + wx / prm[POSITION_GAIN], y + wy / prm[POSITION_GAIN]
    return from_x, from_y, z + wz / prm[POSITION_GAIN_Z], 0.0, 0.0


@compiled
def row_of(tick: int, timer: tuple[float, float, float]) -> int:
    """Find the row nearest to a tick of a timer: time of tick 0, time between ticks, and time
    between rows, s.
    """
    start_s, period_s, grid_s = timer
    return int(np.rint((start_s + tick * period_s) / grid_s))


@compiled
def is_in_box(track: Array, row: int, box: tuple[float, float, float, float, float]) -> bool:
    """Say whether a row's position is in a box: x, y and z of its centre, half its width and half
    its height, m.
    """
    x, y, z, half_width, half_height = box
    off_x, off_y, off_z = abs(track[row, 0] - x), abs(track[row, 1] - y), abs(track[row, 2] - z)
    return bool(off_x <= half_width and off_y <= half_width and off_z <= half_height)


@compiled
def advance(
    track: Array,
    first: int,
    last: int,
    dynamics: Dynamics,
    box: tuple[float, float, float, float, float],
    timer: tuple[float, float, float],
    tick: int,
) -> int:
    """Fill rows first + 1 .. last of the track from row `first`, with one set-point, and no
    thruster failing.

    Args:
        track: shape (rows, COLUMNS); written in place.
        first: row to start from.
        last: last row to fill; or the first row at a tick that finds the vehicle in the box.
        dynamics: time step, set-point and constants.
        box, timer, tick: see `is_in_box` and `row_of`; the first tick that is checked.

    Returns:
        The tick that finds the vehicle in the box; -1 if none does.
    """
    check_row = row_of(tick, timer)
    h, set_point, prm, allocation, wrenches, thrusters = dynamics
    mass, ixx, iyy, izz = prm[MASS], prm[IXX], prm[IYY], prm[IZZ]
    heading_w, heading_z, number = (
        set_point[HALF_HEADING_COS],
        set_point[HALF_HEADING_SIN],
        set_point[NUMBER],
    )
    # Unpacking a slice would create an array, which takes as long as a step.
    x, y, z = track[first, 0], track[first, 1], track[first, 2]
    qw, qx, qy, qz = track[first, 3], track[first, 4], track[first, 5], track[first, 6]
    u, v, w = track[first, 7], track[first, 8], track[first, 9]
    p, q, r = track[first, 10], track[first, 11], track[first, 12]
    ix, iy, iz, ir = track[first, 13], track[first, 14], track[first, 15], track[first, 16]
    from_x, from_y, from_z = track[first, 17], track[first, 18], track[first, 19]
    to_x, to_y, to_z = track[first, 20], track[first, 21], track[first, 22]
    leg_time, quarter = track[first, LEG_TIME], track[first, LEG_QUARTER]
    is_new_leg = track[first, SET_POINT_NUMBER] != set_point[NUMBER]
    if is_new_leg:
        from_x, from_y, from_z, ix, iy = begin_leg(track, first, prm)
        to_x, to_y, to_z, leg_time = set_point[0], set_point[1], set_point[2], 0.0
    along_x, along_y, along_z = to_x - from_x, to_y - from_y, to_z - from_z
    length = math.sqrt(along_x * along_x + along_y * along_y + along_z * along_z)
    if is_new_leg:  # from rest to rest at constant jerk with two sign changes
        quarter = (length / (2.0 * prm[JERK])) ** (1.0 / 3.0)
    if length > 0.0:
        along_x, along_y, along_z = along_x / length, along_y / length, along_z / length
    top_speed = prm[JERK] * quarter * quarter
    # A multiplication takes a fraction of the time of a division.
    inverse_mass, inverse_ixx, inverse_iyy, inverse_izz = (
        1.0 / mass,
        1.0 / ixx,
        1.0 / iyy,
        1.0 / izz,
    )
    for row in range(first + 1, last + 1):
        # Rotation matrix R, body to world (Handbook, 2.69).
        r00 = 1.0 - 2.0 * (qy * qy + qz * qz)
        r01 = 2.0 * (qx * qy - qz * qw)
        r02 = 2.0 * (qx * qz + qy * qw)
        r10 = 2.0 * (qx * qy + qz * qw)
        r11 = 1.0 - 2.0 * (qx * qx + qz * qz)
        r12 = 2.0 * (qy * qz - qx * qw)
        r20 = 2.0 * (qx * qz - qy * qw)
        r21 = 2.0 * (qy * qz + qx * qw)
        r22 = 1.0 - 2.0 * (qx * qx + qy * qy)

        # Guided autopilot. Its target moves along the leg: jerk +, -, -, + for a quarter of the
        # leg's time each.
        wx, wy, wz = (
            r00 * u + r01 * v + r02 * w,
            r10 * u + r11 * v + r12 * w,
            r20 * u + r21 * v + r22 * w,
        )
        leg_time += h
        distance, speed = length, 0.0
        left = min(leg_time, 4.0 * quarter - leg_time)  # time to the nearer end
        if left > 0.0:
            if left < quarter:
                speed = 0.5 * prm[JERK] * left * left
                distance = speed * left / 3.0
            else:
                left = 2.0 * quarter - left  # time to the middle
                slower = 0.5 * (left * left * prm[JERK])
                speed = top_speed - slower
                distance = 0.5 * length - left * (top_speed - slower / 3.0)
            if leg_time > 2.0 * quarter:
                distance = length - distance
        ex, ey, ez = (
            from_x + distance * along_x - x,
            from_y + distance * along_y - y,
            from_z + distance * along_z - z,
        )
        # Outer loop: position error to velocity, besides the target's own. Inner loop:
        # proportional-integral on the velocity's error in the world frame, demanded as a force in
        # the body frame.
        ex = prm[POSITION_GAIN] * ex + along_x * speed - wx
        ey = prm[POSITION_GAIN] * ey + along_y * speed - wy
        ez = prm[POSITION_GAIN_Z] * ez + along_z * speed - wz
        bound = prm[INTEGRAL_LIMIT]
        ix = clamp(ix + h * prm[VELOCITY_INTEGRAL_GAIN] * ex, bound)
        iy = clamp(iy + h * prm[VELOCITY_INTEGRAL_GAIN] * ey, bound)
        iz = clamp(iz + h * prm[VELOCITY_INTEGRAL_GAIN_Z] * ez, bound)
        fx = mass * (prm[VELOCITY_GAIN] * ex + ix)
        fy = mass * (prm[VELOCITY_GAIN] * ey + iy)
        fz = mass * (prm[VELOCITY_GAIN_Z] * ez + iz)
        d0 = r00 * fx + r10 * fy + r20 * fz
        d1 = r01 * fx + r11 * fy + r21 * fz
        d2 = r02 * fx + r12 * fy + r22 * fz

        # Attitude: the vector part of conj(q) * q_heading is half the turn that is left, in the
        # body frame.
        ew = qw * heading_w + qz * heading_z
        sign = 2.0 if ew >= 0.0 else -2.0
        e_roll = sign * (-qx * heading_w - qy * heading_z)
        e_yaw = sign * (-qz * heading_w + qw * heading_z)
        bound = prm[HEADING_INTEGRAL_LIMIT]
        ir = clamp(ir + h * prm[HEADING_INTEGRAL_GAIN] * e_yaw, bound)
        d3 = ixx * (prm[ROLL_GAIN] * e_roll - prm[ROLL_RATE_GAIN] * p)
        d5 = izz * (prm[HEADING_GAIN] * e_yaw - prm[HEADING_RATE_GAIN] * r + ir)

        # Thrusters: allocate as if all worked, limit each. One loop, min and max, or C's order: 4
        # to 13% slower.
        for i in range(6):
            thrust = allocation[i, 0] * d0 + allocation[i, 1] * d1 + allocation[i, 2] * d2
            thrust = thrust + allocation[i, 3] * d3 + allocation[i, 5] * d5
            least, greatest = thrusters[i, LEAST], thrusters[i, GREATEST]
            thrusters[i, LAST] = (
                least if thrust < least else greatest if thrust > greatest else thrust
            )
        t0 = t1 = t2 = t3 = t4 = t5 = 0.0
        for i in range(6):
            thrust = thrusters[i, LAST]
            t0 += wrenches[0, i] * thrust
            t1 += wrenches[1, i] * thrust
            t2 += wrenches[2, i] * thrust
            t3 += wrenches[3, i] * thrust
            t4 += wrenches[4, i] * thrust
            t5 += wrenches[5, i] * thrust

        # Buoyancy above the centre of mass: a net force, and a moment that rights roll and pitch
        # (Handbook, 4.1).
        t0 += prm[NET_BUOYANCY] * r20
        t1 += prm[NET_BUOYANCY] * r21
        t2 += prm[NET_BUOYANCY] * r22
        t3 -= prm[RIGHTING] * r21
        t4 += prm[RIGHTING] * r20

        # M nu' = tau - C(nu) nu - D(nu_r) nu_r, drag taken implicitly: it stays stable at any
        # speed.
        cx, cy, cz = prm[CURRENT], prm[CURRENT + 1], prm[CURRENT + 2]
        if prm[WAVE_RATE] != 0.0:  # the current varies over time, which the row counts
            wave = math.sin(prm[WAVE_RATE] * row + prm[WAVE_PHASE])
            cx, cy = cx + prm[WAVE_X] * wave, cy + prm[WAVE_Y] * wave
        cu = r00 * cx + r10 * cy + r20 * cz
        cv = r01 * cx + r11 * cy + r21 * cz
        cw = r02 * cx + r12 * cy + r22 * cz
        au = t0 * inverse_mass - (q * w - r * v)
        av = t1 * inverse_mass - (r * u - p * w)
        aw = t2 * inverse_mass - (p * v - q * u)
        ap = (t3 - (izz - iyy) * q * r) * inverse_ixx
        aq = (t4 - (ixx - izz) * r * p) * inverse_iyy
        ar = (t5 - (iyy - ixx) * p * q) * inverse_izz
        u = cu + (u + h * au - cu) / (1.0 + h * prm[DRAG] * abs(u - cu))
        v = cv + (v + h * av - cv) / (1.0 + h * prm[DRAG + 1] * abs(v - cv))
        w = cw + (w + h * aw - cw) / (1.0 + h * prm[DRAG + 2] * abs(w - cw))
        p = (p + h * ap) / (1.0 + h * prm[DRAG + 3] * abs(p))
        q = (q + h * aq) / (1.0 + h * prm[DRAG + 4] * abs(q))
        r = (r + h * ar) / (1.0 + h * prm[DRAG + 5] * abs(r))

        # Kinematics with the new velocity (semi-implicit Euler): p' = R v, q' = T_q(q) omega
        # (Handbook, 2.86).
        x += h * (r00 * u + r01 * v + r02 * w)
        y += h * (r10 * u + r11 * v + r12 * w)
        z += h * (r20 * u + r21 * v + r22 * w)
        # Neither into the sea bed nor out of the water; like ArduSub's, the controller does not
        # wind up against it.
        if z < prm[FLOOR] or z > prm[CEILING]:
            z = min(max(z, prm[FLOOR]), prm[CEILING])
            through = r20 * u + r21 * v + r22 * w
            u, v, w = u - r20 * through, v - r21 * through, w - r22 * through
            iz = max(iz, 0.0) if z == prm[FLOOR] else min(iz, 0.0)
        dw = -qx * p - qy * q - qz * r
        dx = qw * p + qy * r - qz * q
        dy = qw * q + qz * p - qx * r
        dz = qw * r + qx * q - qy * p
        qw += 0.5 * h * dw
        qx += 0.5 * h * dx
        qy += 0.5 * h * dy
        qz += 0.5 * h * dz
        # The norm's inverse: near 1, one step of Newton's method from there is less than 4e-7 off,
        # which the next row corrects; the square root and the division take an eighth of a step's
        # time.
        square = qw * qw + qx * qx + qy * qy + qz * qz
        scale = 1.5 - 0.5 * square if abs(square - 1.0) < 1e-3 else 1.0 / math.sqrt(square)
        qw, qx, qy, qz = qw * scale, qx * scale, qy * scale, qz * scale

        track[row, 0], track[row, 1], track[row, 2] = x, y, z
        track[row, 3], track[row, 4], track[row, 5], track[row, 6] = qw, qx, qy, qz
        track[row, 7], track[row, 8], track[row, 9] = u, v, w
        track[row, 10], track[row, 11], track[row, 12] = p, q, r
        track[row, 13], track[row, 14], track[row, 15], track[row, 16] = ix, iy, iz, ir
        track[row, 17], track[row, 18], track[row, 19] = from_x, from_y, from_z
        track[row, 20], track[row, 21], track[row, 22] = to_x, to_y, to_z
        track[row, LEG_TIME], track[row, LEG_QUARTER], track[row, SET_POINT_NUMBER] = (
            leg_time,
            quarter,
            number,
        )
        while row == check_row:
            if is_in_box(track, row, box):
                return tick
            tick += 1
            check_row = row_of(tick, timer)
    return -1


@compiled
def fly_waypoints(
    track: Array,
    computed: int,
    end: int,
    dynamics: Dynamics,
    waypoints: Array,
    courses: Array,
    sends: IntArray,
) -> tuple[int, bool, int]:
    """Fly along one course or two: a tick that finds a way-point reached, or not in time, sends a
    set-point.

    Args:
        track, computed, dynamics: as for `advance`, and the last row that is filled; the set-point
        given last remains.
        end: the row up to which to fill, after the first course's last tick.
        waypoints: x, y and z in the first columns, m, shape (n, at least 3).
        courses: shape (courses, 18), see `START` and the others.
        sends: shape (m, 4), with one more than the courses' room in all; receives for each
            set-point its tick, its course, how many of the course's way-points are reached by then,
            and the tick that sends it again. The last of them is not given if there is no room for
            more, if it leads to no way-point, or if the one before is reached but for its height.

    Returns:
        How many set-points there are; whether the last of them is left to the caller; and the last
        row of the track that is now filled. Ticks beyond the track do not count.
    """
    set_point, sent, last_row, courses = dynamics[1], 0, track.shape[0] - 1, courses.copy()
    while True:
        course = 0
        if courses.shape[0] > 1:
            first_s = courses[0, START] + courses[0, TICK] * courses[0, PERIOD]
            course = int(courses[1, START] + courses[1, TICK] * courses[1, PERIOD] < first_s)
        this = courses[course]
        timer, until = (this[START], this[PERIOD], this[GRID]), this[UNTIL]
        tick, again, place = int(this[TICK]), int(this[AGAIN]), int(this[PLACE])
        if tick > until or row_of(tick, timer) > last_row:
            break
        box = (
            waypoints[place, 0],
            waypoints[place, 1],
            waypoints[place, 2],
            this[HALF_WIDTH],
            this[HALF_HEIGHT],
        )
        if row_of(tick, timer) > computed:
            goal = again if courses.shape[0] == 1 else tick
            last = min(row_of(int(min(goal, until)), timer), last_row)
            found = advance(track, computed, last, dynamics, box, timer, tick)
            is_reached = 0 <= found <= min(goal, until)
            tick = found if is_reached else goal
            computed = row_of(tick, timer) if is_reached else last
            if tick > until or row_of(tick, timer) > last_row:
                break
        else:
            is_reached = is_in_box(track, row_of(tick, timer), box)
        if not is_reached and tick < again:
            this[TICK] = tick + 1
            continue
        row = row_of(tick, timer)
        is_level = is_reached or not is_in_box(track, row, (*box[:4], np.inf))
        place += is_reached
        again = tick + int(this[MOST] if is_reached else this[MOST_AGAIN])
        sends[sent, 0], sends[sent, 1], sends[sent, 2], sends[sent, 3] = (
            tick,
            course,
            place - int(this[FIRST]),
            again,
        )
        sent += 1
        if place == this[END] or this[ROOM] == 0.0 or not is_level:
            return sent, True, computed
        set_point[0], set_point[1] = (
            waypoints[place, 0] + this[SENT_X],
            waypoints[place, 1] + this[SENT_Y],
        )
        set_point[2] = this[SENT_Z]
        set_point[NUMBER] += 1.0
        computed = row  # rows beyond it were flown to another set-point
        this[TICK], this[AGAIN], this[PLACE], this[ROOM] = (
            tick + this[FEWEST],
            again,
            place,
            this[ROOM] - 1.0,
        )
    advance(track, computed, end, dynamics, *UNCHECKED)
    return sent, False, max(computed, end)

"""The vehicle's motion: rigid body, thrusters and guided autopilot, stepped on a fixed grid by one
compiled loop.

Attitude is a quaternion (Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2.2.2):
no trigonometry in the loop, and no singularity for a vehicle that tumbles. The other numbers after
"Handbook" are sections or equations of that book.
"""

import math
from typing import Annotated

from suave_des.compiling import Array, Record, Records, compiled, record

# Columns of the track: the pose at each row; the world frame has x east, y north, z up.
POSITION = slice(0, 3)  # p, world frame, m

TRACK_COLUMNS = 7

ARRIVED_M = 2.0
"""ArduPilot's WPNAV_RADIUS: a leg is complete when its time is over and the vehicle is this near to
its end.
"""


@record
class VehicleRecord(Record):
    """A vehicle: its constants, how it is controlled, and its state, which is all that the next
    step needs.
    """

    # Constants of the body, and of the water around it.
    step_s: float  # time between rows, as the simulated world counts it
    mass_kg: float
    inertia_x_kg_m2: float  # principal moments
    inertia_y_kg_m2: float
    inertia_z_kg_m2: float
    net_buoyancy_n: float  # buoyancy less weight
    righting_n_m: float  # buoyancy times its height above the centre of mass
    drag: Annotated[Array, (6,)]  # c / mass or moment of inertia of -c |nu| nu, 1/m and 1/rad
    allocation: Annotated[Array, (6, 6)]  # column i: of wrench component i to each thruster
    wrenches: Annotated[Array, (6, 6)]  # its transpose: row i is the wrench of thruster i at 1 N
    current_x_m_per_s: float  # constant velocity of the water, world frame
    current_y_m_per_s: float
    current_z_m_per_s: float
    wave_x_m_per_s: float  # amplitude of the varying part of the current
    wave_y_m_per_s: float
    wave_rate_rad: float  # its angle per row
    wave_phase_rad: float  # its angle at row 0
    floor_z_m: float  # sea bed
    ceiling_z_m: float  # surface

    # Constants of the autopilot.
    position_gain_per_s: float  # velocity for a horizontal position error
    position_gain_z_per_s: float
    jerk_m_per_s3: float  # of a leg
    velocity_gain_per_s: float  # acceleration for a horizontal velocity error
    velocity_gain_z_per_s: float
    velocity_integral_gain_per_s2: float  # acceleration for its integral
    velocity_integral_gain_z_per_s2: float
    integral_limit_m_per_s2: float  # of each velocity integral
    roll_gain_per_s2: float  # angular acceleration for a roll error
    roll_rate_gain_per_s: float
    heading_gain_per_s2: float
    heading_rate_gain_per_s: float
    heading_integral_gain_per_s3: float
    heading_integral_limit_rad_per_s2: float

    # How it is controlled: the set-point, and what each thruster can give, equal for one that has
    # failed.
    set_point_x_m: float
    set_point_y_m: float
    set_point_z_m: float
    half_heading_cos: float
    half_heading_sin: float
    set_point_number: int  # how many set-points were given before
    least_n: Annotated[Array, (6,)]
    greatest_n: Annotated[Array, (6,)]

    # Its state at a row of the track.
    row: int
    x_m: float  # p, world frame
    y_m: float
    z_m: float
    qw: float  # attitude
    qx: float
    qy: float
    qz: float
    u_m_per_s: float  # nu, body frame
    v_m_per_s: float
    w_m_per_s: float
    p_rad_per_s: float
    q_rad_per_s: float
    r_rad_per_s: float
    integral_x_m_per_s2: float  # of the velocity error, world frame, as an acceleration
    integral_y_m_per_s2: float
    integral_z_m_per_s2: float
    heading_integral_rad_per_s2: float  # of the heading error, as an angular acceleration
    thrust_n: Annotated[Array, (6,)]  # what the thrusters gave in the last step

    # The leg that the autopilot flies.
    leg_number: int  # of the set-point that it leads to; the one at the start is number 0
    leg_start_x_m: float  # world frame
    leg_start_y_m: float
    leg_start_z_m: float
    leg_end_x_m: float
    leg_end_y_m: float
    leg_end_z_m: float
    leg_along_x: float  # its direction, a unit vector
    leg_along_y: float
    leg_along_z: float
    leg_length_m: float
    leg_top_speed_m_per_s: float
    leg_quarter_s: float  # a quarter of its duration
    leg_time_s: float  # since it began


@compiled
def clamp(value: float, limit: float) -> float:
    """Limit a value to -limit .. limit; a little quicker here than min and max."""
    return -limit if value < -limit else limit if value > limit else value


@compiled
def begin_leg(vehicle: VehicleRecord) -> None:
    """Begin the leg to a new set-point, as ArduPilot's waypoint controller does (AC_WPNav,
    set_wp_destination).

    If the leg before is completed, the new one starts at its end. If not, the controller starts
    from the stopping point of the vehicle, without the integral that it had built up.
    """
    x, y, z = vehicle.x_m, vehicle.y_m, vehicle.z_m
    to_x, to_y, to_z = vehicle.leg_end_x_m, vehicle.leg_end_y_m, vehicle.leg_end_z_m
    is_over = vehicle.leg_time_s >= 4.0 * vehicle.leg_quarter_s
    if is_over and (to_x - x) ** 2 + (to_y - y) ** 2 + (to_z - z) ** 2 <= ARRIVED_M * ARRIVED_M:
        from_x, from_y, from_z = to_x, to_y, to_z
    else:
        qw, qx, qy, qz = vehicle.qw, vehicle.qx, vehicle.qy, vehicle.qz
        u, v, w = vehicle.u_m_per_s, vehicle.v_m_per_s, vehicle.w_m_per_s
        # R nu as q nu q*: nu + 2 qw (e x nu) + 2 e x (e x nu), with the vector part e of q
        # (Handbook, 2.2.2).
        cx, cy, cz = qy * w - qz * v, qz * u - qx * w, qx * v - qy * u
        wx = u + 2.0 * (qw * cx + qy * cz - qz * cy)
        wy = v + 2.0 * (qw * cy + qz * cx - qx * cz)
        wz = w + 2.0 * (qw * cz + qx * cy - qy * cx)
        from_x = x + wx / vehicle.position_gain_per_s
        from_y = y + wy / vehicle.position_gain_per_s
        from_z = z + wz / vehicle.position_gain_z_per_s
        vehicle.integral_x_m_per_s2 = vehicle.integral_y_m_per_s2 = 0.0
    to_x, to_y, to_z = vehicle.set_point_x_m, vehicle.set_point_y_m, vehicle.set_point_z_m
    along_x, along_y, along_z = to_x - from_x, to_y - from_y, to_z - from_z
    length = math.sqrt(along_x * along_x + along_y * along_y + along_z * along_z)
    # From rest to rest at constant jerk with two sign changes.
    quarter = (length / (2.0 * vehicle.jerk_m_per_s3)) ** (1.0 / 3.0)
    if length > 0.0:
        along_x, along_y, along_z = along_x / length, along_y / length, along_z / length
    vehicle.leg_start_x_m, vehicle.leg_start_y_m, vehicle.leg_start_z_m = from_x, from_y, from_z
    vehicle.leg_end_x_m, vehicle.leg_end_y_m, vehicle.leg_end_z_m = to_x, to_y, to_z
    vehicle.leg_along_x, vehicle.leg_along_y, vehicle.leg_along_z = along_x, along_y, along_z
    vehicle.leg_length_m = length
    vehicle.leg_top_speed_m_per_s = vehicle.jerk_m_per_s3 * quarter * quarter
    vehicle.leg_quarter_s = quarter
    vehicle.leg_time_s = 0.0
    vehicle.leg_number = vehicle.set_point_number


@compiled
def along_leg(
    time: float, length: float, quarter: float, jerk: float, top_speed: float
) -> tuple[float, float]:
    """Find how far the autopilot's target has moved along a leg, m, and how fast it is, m/s: jerk
    +, -, -, + for a quarter of the leg's time each.

    Args:
        time: since the leg began, s.
        length: of the leg, m.
        quarter: a quarter of its time, s.
        jerk: m/s3.
        top_speed: in the middle of the leg, m/s.
    """
    left = min(time, 4.0 * quarter - time)  # time to the nearer end
    if left <= 0.0:
        return length, 0.0
    if left < quarter:
        speed = 0.5 * jerk * left * left
        distance = speed * left / 3.0
    else:
        left = 2.0 * quarter - left  # time to the middle
        slower = 0.5 * (left * left * jerk)
        speed = top_speed - slower
        distance = 0.5 * length - left * (top_speed - slower / 3.0)
    if time > 2.0 * quarter:
        distance = length - distance
    return distance, speed


@compiled
def advance(vehicles: Records, track: Array, last: int) -> None:
    """Fly a vehicle up to a row, with one set-point, and no thruster failing.

    Args:
        vehicles: its record is the first; it is updated.
        track: shape (rows, COLUMNS); the rows after the vehicle's, up to `last`, are filled.
        last: a row after the vehicle's.
    """
    vehicle: VehicleRecord = vehicles[0]
    if vehicle.leg_number != vehicle.set_point_number:
        begin_leg(vehicle)
    h, mass = vehicle.step_s, vehicle.mass_kg
    ixx, iyy, izz = vehicle.inertia_x_kg_m2, vehicle.inertia_y_kg_m2, vehicle.inertia_z_kg_m2
    # A multiplication takes a fraction of the time of a division.
    inverse_mass, inverse_ixx, inverse_iyy, inverse_izz = (
        1.0 / mass,
        1.0 / ixx,
        1.0 / iyy,
        1.0 / izz,
    )
    drag, allocation, wrenches = vehicle.drag, vehicle.allocation, vehicle.wrenches
    # The loop would read these from the record in each row, as it writes thrusts to it: a
    # twenty-fifth of its time.
    drag_u = h * drag[0]
    drag_v = h * drag[1]
    drag_w = h * drag[2]
    drag_p = h * drag[3]
    drag_q = h * drag[4]
    drag_r = h * drag[5]
    net_buoyancy = vehicle.net_buoyancy_n
    righting = vehicle.righting_n_m
    current_x = vehicle.current_x_m_per_s
    current_y = vehicle.current_y_m_per_s
    current_z = vehicle.current_z_m_per_s
    wave_rate = vehicle.wave_rate_rad
    floor_z = vehicle.floor_z_m
    ceiling_z = vehicle.ceiling_z_m
    least_n, greatest_n, thrust_n = vehicle.least_n, vehicle.greatest_n, vehicle.thrust_n
    gain, gain_z = vehicle.velocity_gain_per_s, vehicle.velocity_gain_z_per_s
    integral_gain = vehicle.velocity_integral_gain_per_s2
    integral_gain_z = vehicle.velocity_integral_gain_z_per_s2
    jerk, heading_w, heading_z = (
        vehicle.jerk_m_per_s3,
        vehicle.half_heading_cos,
        vehicle.half_heading_sin,
    )
    from_x, from_y, from_z = vehicle.leg_start_x_m, vehicle.leg_start_y_m, vehicle.leg_start_z_m
    along_x, along_y, along_z = vehicle.leg_along_x, vehicle.leg_along_y, vehicle.leg_along_z
    length, top_speed = vehicle.leg_length_m, vehicle.leg_top_speed_m_per_s
    quarter, leg_time = vehicle.leg_quarter_s, vehicle.leg_time_s
    x, y, z = vehicle.x_m, vehicle.y_m, vehicle.z_m
    qw, qx, qy, qz = vehicle.qw, vehicle.qx, vehicle.qy, vehicle.qz
    u, v, w = vehicle.u_m_per_s, vehicle.v_m_per_s, vehicle.w_m_per_s
    p, q, r = vehicle.p_rad_per_s, vehicle.q_rad_per_s, vehicle.r_rad_per_s
    ix, iy = vehicle.integral_x_m_per_s2, vehicle.integral_y_m_per_s2
    iz, ir = vehicle.integral_z_m_per_s2, vehicle.heading_integral_rad_per_s2
    for row in range(vehicle.row + 1, last + 1):
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

        # Guided autopilot. Its target moves along the leg.
        wx, wy, wz = (
            r00 * u + r01 * v + r02 * w,
            r10 * u + r11 * v + r12 * w,
            r20 * u + r21 * v + r22 * w,
        )
        leg_time += h
        distance, speed = along_leg(leg_time, length, quarter, jerk, top_speed)
        ex, ey, ez = (
            from_x + distance * along_x - x,
            from_y + distance * along_y - y,
            from_z + distance * along_z - z,
        )
        # Outer loop: position error to velocity, besides the target's own. Inner loop:
        # proportional-integral on the velocity's error in the world frame, demanded as a force in
        # the body frame.
        ex = vehicle.position_gain_per_s * ex + along_x * speed - wx
        ey = vehicle.position_gain_per_s * ey + along_y * speed - wy
        ez = vehicle.position_gain_z_per_s * ez + along_z * speed - wz
        bound = vehicle.integral_limit_m_per_s2
        ix = clamp(ix + h * integral_gain * ex, bound)
        iy = clamp(iy + h * integral_gain * ey, bound)
        iz = clamp(iz + h * integral_gain_z * ez, bound)
        fx = mass * (gain * ex + ix)
        fy = mass * (gain * ey + iy)
        fz = mass * (gain_z * ez + iz)
        d0 = r00 * fx + r10 * fy + r20 * fz
        d1 = r01 * fx + r11 * fy + r21 * fz
        d2 = r02 * fx + r12 * fy + r22 * fz

        # Attitude: the vector part of conj(q) * q_heading is half the turn that is left, in the
        # body frame.
        ew = qw * heading_w + qz * heading_z
        sign = 2.0 if ew >= 0.0 else -2.0
        e_roll = sign * (-qx * heading_w - qy * heading_z)
        e_yaw = sign * (-qz * heading_w + qw * heading_z)
        bound = vehicle.heading_integral_limit_rad_per_s2
        ir = clamp(ir + h * vehicle.heading_integral_gain_per_s3 * e_yaw, bound)
        d3 = ixx * (vehicle.roll_gain_per_s2 * e_roll - vehicle.roll_rate_gain_per_s * p)
        d5 = izz * (vehicle.heading_gain_per_s2 * e_yaw - vehicle.heading_rate_gain_per_s * r + ir)

        # Thrusters: allocate as if all worked, limit each. One loop, min and max, or C's order: 4
        # to 13% slower.
        for i in range(6):
            thrust = allocation[0, i] * d0 + allocation[1, i] * d1 + allocation[2, i] * d2
            thrust = thrust + allocation[3, i] * d3 + allocation[5, i] * d5
            least, greatest = least_n[i], greatest_n[i]
            thrust_n[i] = least if thrust < least else greatest if thrust > greatest else thrust
        t0 = t1 = t2 = t3 = t4 = t5 = 0.0
        for i in range(6):
            thrust = thrust_n[i]
            t0 += wrenches[i, 0] * thrust
            t1 += wrenches[i, 1] * thrust
            t2 += wrenches[i, 2] * thrust
            t3 += wrenches[i, 3] * thrust
            t4 += wrenches[i, 4] * thrust
            t5 += wrenches[i, 5] * thrust

        # Buoyancy above the centre of mass: a net force, and a moment that rights roll and pitch
        # (Handbook, 4.1).
        t0 += net_buoyancy * r20
        t1 += net_buoyancy * r21
        t2 += net_buoyancy * r22
        t3 -= righting * r21
        t4 += righting * r20

        # M nu' = tau - C(nu) nu - D(nu_r) nu_r, drag taken implicitly: it stays stable at any
        # speed.
        cx, cy, cz = current_x, current_y, current_z
        if wave_rate != 0.0:  # the current varies over time, which the row counts
            wave = math.sin(wave_rate * row + vehicle.wave_phase_rad)
            cx, cy = cx + vehicle.wave_x_m_per_s * wave, cy + vehicle.wave_y_m_per_s * wave
        cu = r00 * cx + r10 * cy + r20 * cz
        cv = r01 * cx + r11 * cy + r21 * cz
        cw = r02 * cx + r12 * cy + r22 * cz
        au = t0 * inverse_mass - (q * w - r * v)
        av = t1 * inverse_mass - (r * u - p * w)
        aw = t2 * inverse_mass - (p * v - q * u)
        ap = (t3 - (izz - iyy) * q * r) * inverse_ixx
        aq = (t4 - (ixx - izz) * r * p) * inverse_iyy
        ar = (t5 - (iyy - ixx) * p * q) * inverse_izz
        u = cu + (u + h * au - cu) / (1.0 + drag_u * abs(u - cu))
        v = cv + (v + h * av - cv) / (1.0 + drag_v * abs(v - cv))
        w = cw + (w + h * aw - cw) / (1.0 + drag_w * abs(w - cw))
        p = (p + h * ap) / (1.0 + drag_p * abs(p))
        q = (q + h * aq) / (1.0 + drag_q * abs(q))
        r = (r + h * ar) / (1.0 + drag_r * abs(r))

        # Kinematics with the new velocity (semi-implicit Euler): p' = R v, q' = T_q(q) omega
        # (Handbook, 2.86).
        x += h * (r00 * u + r01 * v + r02 * w)
        y += h * (r10 * u + r11 * v + r12 * w)
        z += h * (r20 * u + r21 * v + r22 * w)
        # Neither into the sea bed nor out of the water; like ArduSub's, the controller does not
        # wind up against it.
        if z < floor_z or z > ceiling_z:
            z = min(max(z, floor_z), ceiling_z)
            through = r20 * u + r21 * v + r22 * w
            u, v, w = u - r20 * through, v - r21 * through, w - r22 * through
            iz = max(iz, 0.0) if z == floor_z else min(iz, 0.0)
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

    vehicle.row = last
    vehicle.x_m, vehicle.y_m, vehicle.z_m = x, y, z
    vehicle.qw, vehicle.qx, vehicle.qy, vehicle.qz = qw, qx, qy, qz
    vehicle.u_m_per_s, vehicle.v_m_per_s, vehicle.w_m_per_s = u, v, w
    vehicle.p_rad_per_s, vehicle.q_rad_per_s, vehicle.r_rad_per_s = p, q, r
    vehicle.integral_x_m_per_s2, vehicle.integral_y_m_per_s2 = ix, iy
    vehicle.integral_z_m_per_s2, vehicle.heading_integral_rad_per_s2 = iz, ir
    vehicle.leg_time_s = leg_time

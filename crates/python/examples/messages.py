# ANCHOR: set
from jaus.messages import core, mobility

pose = mobility.ReportLocalPose(x_m=2.5, yaw_rad=-1)
pose.time_stamp = pose.TimeStamp(day=3, hour=12)
octets = pose.encode()

received = mobility.ReportLocalPose.decode(octets)
print(received.x_m, received.y_m, received.time_stamp.hour)
# ANCHOR_END: set

# ANCHOR: errors
from jaus import DecodeError, FieldError

for attempt in (
    lambda: mobility.ReportGlobalPose(latitude_deg=91),
    lambda: mobility.ReportGlobalPose(latitude_degrees=53),
    lambda: mobility.ReportLocalPose.decode(octets[:6]),
):
    try:
        attempt()
    except (FieldError, DecodeError, TypeError) as error:
        print(f"{type(error).__name__}: {error}")
# ANCHOR_END: errors

# ANCHOR: decode
from jaus import messages

match messages.decode(octets):
    case mobility.ReportLocalPose(x_m=x, y_m=y):
        print("pose", x, y)
    case core.ReportIdentification() as report:
        print("identification", report.identification)
    case messages.Unknown(code=code):
        print(f"no definition has {code:04X}h")
# ANCHOR_END: decode

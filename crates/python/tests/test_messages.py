"""What an application does with messages."""

import copy
import inspect
import math
import pickle
import pydoc

import jaus.errors
import pytest
from jaus import messages
from jaus.errors import DecodeError, FieldError
from jaus.messages import core, mobility

Pose = mobility.ReportLocalPose


def test_a_message_has_the_facts_of_its_definition():
    assert (Pose.code, Pose.name) == (0x4403, "ReportLocalPose")
    assert Pose.service == "urn:jaus:jss:mobility:LocalPoseSensor"
    assert f"{Pose.service} {Pose.version}" in Pose.services
    assert not Pose.is_command and mobility.SetWrenchEffort.is_command
    assert issubclass(Pose, messages.Message)


def test_a_query_knows_its_report_and_asks_for_all_of_it():
    assert mobility.QueryLocalPose.report is Pose
    assert Pose.report is None
    assert mobility.QueryLocalPose().presence_vector == 0b1_1111_1111
    assert mobility.QueryLocalPose(presence_vector=3).presence_vector == 3


def test_a_scaled_integer_is_a_number_in_its_unit_and_keeps_its_integer():
    pose = Pose(x_m=2.5, yaw_rad=-1)
    assert pose.x_m == 2.5 and pose.yaw_rad == -1
    assert pose.x == Pose.X(2.5) and pose.x.raw == 2147537335 and float(pose.x) == 2.5
    assert (pose.x.lower, pose.x.upper, pose.x.units) == (-100000, 100000, "meter")
    again = Pose.decode(pose.encode())
    assert again == pose and again.x.raw == pose.x.raw
    pose.x = Pose.X.from_raw(7)
    assert pose.x.raw == 7 and Pose.decode(pose.encode()).x.raw == 7
    pose.x_m = Pose.X.from_raw(8)
    assert pose.x.raw == 8
    with pytest.raises(AttributeError, match="immutable"):
        pose.x._number = 3


def test_an_absent_field_is_none():
    pose = Pose(x_m=1)
    assert pose.y_m is None and pose.y is None and pose.time_stamp is None
    pose.x_m = None
    assert pose == Pose()
    pose.y_m = 1
    del pose.y_m
    assert pose.encode() == bytes.fromhex("03440000")


@pytest.mark.parametrize("value", [100000.1, -100001, math.inf, math.nan, 10**400])
def test_a_number_out_of_range_is_an_error_and_changes_nothing(value):
    pose = Pose(x_m=1)
    with pytest.raises(FieldError) as caught:
        pose.x_m = value
    assert caught.value.path == "X"
    assert pose.x_m == 1
    with pytest.raises(FieldError):
        Pose(x_m=value)


def test_the_error_names_range_and_unit():
    with pytest.raises(FieldError, match=r"^Latitude: 91\.0 is not in -90 to 90 degree$"):
        mobility.ReportGlobalPose(latitude_deg=91)


@pytest.mark.parametrize("value", ["a", "1", b"1", [], {}, object(), 1j])
def test_a_value_of_another_type_is_a_type_error(value):
    with pytest.raises(TypeError, match="^X: .* a number$"):
        Pose(x_m=value)


def test_an_unknown_field_is_an_error_that_suggests_the_nearest():
    with pytest.raises(TypeError, match="no field x_metres; did you mean x_m?"):
        Pose(x_metres=1)
    with pytest.raises(TypeError, match="did you mean x_m?"):
        Pose(x=Pose.X(1))
    with pytest.raises(TypeError, match="did you mean milliseconds?"):
        Pose.TimeStamp(milisecond=1)
    with pytest.raises(AttributeError):
        Pose().x_metres = 1
    with pytest.raises(AttributeError, match="did you mean ReportLocalPose?"):
        mobility.ReportLocalPos


def test_a_required_field_must_be_given():
    with pytest.raises(TypeError, match="SetGlobalWaypoint needs latitude_deg, longitude_deg"):
        mobility.SetGlobalWaypoint()
    waypoint = mobility.SetGlobalWaypoint(latitude_deg=53, longitude_deg=8)
    with pytest.raises(FieldError, match="Latitude: the member is required"):
        waypoint.latitude_deg = None
    assert core.ReportServices().node_list == []


def test_bit_fields_have_limits():
    stamp = Pose.TimeStamp(day=31, hour=23, milliseconds=999)
    assert (stamp.day, stamp.hour, stamp.seconds, stamp.milliseconds) == (31, 23, 0, 999)
    for day in (0, 32, -1, 10**30):
        with pytest.raises(FieldError, match="^Day: .* is not in 1 to 31$"):
            stamp.day = day
    with pytest.raises(TypeError, match="^Day: 1.5, but the definition has an integer$"):
        stamp.day = 1.5
    assert stamp.day == 31
    assert Pose.TimeStamp.from_raw(stamp.raw) == stamp
    pose = Pose(time_stamp=stamp)
    pose.time_stamp.day = 2
    assert Pose.decode(pose.encode()).time_stamp.day == 2
    assert Pose(time_stamp={"day": 2, "hour": 23, "milliseconds": 999}) == pose


def test_named_values_are_enumerated_and_others_are_preserved():
    Query = core.QueryIdentification
    query = Query(query_type=Query.QueryType.SYSTEM_IDENTIFICATION)
    assert Query.decode(query.encode()).query_type is Query.QueryType.SYSTEM_IDENTIFICATION
    query.query_type = 2
    assert query.query_type is Query.QueryType(2)
    other = Query.decode(b"\x00\x2b\x63")
    assert other.query_type == 0x63 and other.encode() == b"\x00\x2b\x63"
    with pytest.raises(FieldError, match="QueryType: 256 does not fit unsigned byte"):
        query.query_type = 256


def test_text_is_str_if_it_is_utf_8_and_bytes_otherwise():
    Report = core.ReportIdentification
    report = Report(query_type=1, type=1, identification="dépôt")
    assert Report.decode(report.encode()).identification == "dépôt"
    report.identification = b"d\xe9"
    assert Report.decode(report.encode()).identification == b"d\xe9"
    with pytest.raises(FieldError, match="Identification: half of a surrogate pair"):
        report.identification = "\ud800"
    with pytest.raises(FieldError, match="Identification: count 300 is outside 0 to 255"):
        report.identification = "x" * 300


def test_lists_of_records_are_lists():
    Services = core.ReportServices
    component = Services.ComponentRec(component_id=1, instance_id=1)
    node = Services.NodeRec(node_id=1)
    report = Services(node_list=[Services.NodeSeq(node_rec=node)])
    report.node_list[0].component_list.append(Services.ComponentSeq(component_rec=component))
    again = Services.decode(report.encode())
    assert again == report
    assert again.node_list[0].component_list[0].component_rec.component_id == 1
    again.node_list.append("a node")
    with pytest.raises(TypeError, match=r"^ReportServices: NodeList\[1\]: 'a node', but"):
        again.encode()


def test_a_variant_is_one_of_its_alternatives():
    Query = core.QueryEvents
    query = Query(query_events_var=Query.QueryEventsVar(event_id_rec=Query.EventIdRec(event_id=7)))
    again = Query.decode(query.encode()).query_events_var
    assert (again.kind, again.value) == ("event_id_rec", Query.EventIdRec(event_id=7))
    assert again.event_id_rec.event_id == 7 and again.message_id_rec is None
    query.query_events_var = {"all_events_rec": {"all_events": 0}}
    assert query.query_events_var.kind == "all_events_rec"
    with pytest.raises(TypeError, match="is one of message_id_rec, .*; 0 are given"):
        Query.QueryEventsVar()
    with pytest.raises(TypeError, match="2 are given"):
        Query.QueryEventsVar(event_id_rec={"event_id": 7}, all_events_rec={"all_events": 0})
    with pytest.raises(TypeError, match="did you mean event_id_rec?"):
        Query.QueryEventsVar(event_id=1)
    with pytest.raises(AttributeError):
        query.query_events_var.kind = "event_id_rec"


def test_a_measure_is_a_number_in_one_of_its_units():
    Set = mobility.SetGlobalWaypointExt
    waypoint = Set(latitude_deg=1, longitude_deg=2, z_position=Set.ZPosition(depth=12.5))
    z = Set.decode(waypoint.encode()).z_position
    assert (z.kind, z.value, z.units) == ("depth", 12.5, "meter")
    assert z.depth == 12.5 and z.altitude_agl is None and isinstance(z.raw, int)
    with pytest.raises(FieldError, match="is not in"):
        Set.ZPosition(depth=1e9)
    with pytest.raises(TypeError, match="Depth|depth"):
        Set.ZPosition(depth="deep")


def test_octets_are_decoded_whole_or_not_at_all():
    octets = mobility.ReportGlobalPose(latitude_deg=1, longitude_deg=2).encode()
    with pytest.raises(DecodeError) as caught:
        mobility.ReportGlobalPose.decode(octets[:10])
    error = caught.value
    assert (error.message, error.path, error.offset) == ("ReportGlobalPose", "Longitude", 8)
    assert str(error) == ("ReportGlobalPose: Longitude: octets needed: 4, left: 2 at octet 8")
    with pytest.raises(DecodeError, match="message code 4402h, expected 4403h"):
        Pose.decode(octets)
    with pytest.raises(TypeError, match="a message is bytes, not int"):
        Pose.decode(5)


def test_the_class_is_found_by_the_message_code():
    octets = Pose(x_m=1).encode()
    assert messages.decode(octets) == Pose(x_m=1)
    assert messages.decode(memoryview(octets)) == Pose(x_m=1)
    assert messages.decode(octets, service=Pose.service) == Pose(x_m=1)
    assert messages.decode(octets, service=f"{Pose.service}@{Pose.version}") == Pose(x_m=1)
    unknown = messages.decode(b"\xee\xee\x05")
    assert isinstance(unknown, messages.Unknown)
    assert (unknown.name, unknown.encode()) == ("EEEEh", b"\xee\xee\x05")
    with pytest.raises(DecodeError, match="there are only 1"):
        messages.decode(b"\x03")
    with pytest.raises(ValueError, match="did you mean urn:jaus:jss:mobility:LocalPoseSensor"):
        messages.decode(b"\xee\xee\x05", service="urn:jaus:jss:mobility:LocalPoseSensr")


def test_every_version_has_its_layout_and_the_newest_is_that_of_the_set():
    newest = mobility.ReportAccelerationState
    assert mobility.v0_6.ReportAccelerationState is not newest
    assert mobility.v1_1.ReportAccelerationState is newest
    # Versions with one layout share a class, which is named after the oldest of them.
    assert mobility.v1_0.ReportAccelerationState is newest
    assert newest.__qualname__ == "v1_0.ReportAccelerationState"
    assert "ReportLocalPose" in dir(mobility) and "v1_0" in dir(mobility)
    assert "ReportLocalPose" in mobility.__all__


def test_json_is_the_view_that_the_tool_prints():
    pose = Pose(x_m=2.5, time_stamp=Pose.TimeStamp(day=3))
    view = pose.to_json()
    assert view["X"] == 2.5 and view["TimeStamp"]["Day"] == 3 and "Y" not in view
    assert Pose.from_json(view) == pose
    assert Pose.from_json('{"X": 2.5}') == Pose(x_m=2.5)
    with pytest.raises(FieldError, match="X: 1000000 is outside the range"):
        Pose.from_json({"X": 1e6})
    with pytest.raises(FieldError, match='unknown key "Q"'):
        Pose.from_json({"Q": 1})
    for bad in ("{", "", "[1", {"X": math.nan}):
        with pytest.raises(ValueError):
            Pose.from_json(bad)


def test_messages_are_copied_replaced_and_pickled():
    pose = Pose(x_m=1, time_stamp=Pose.TimeStamp(day=3))
    for again in (copy.copy(pose), copy.deepcopy(pose), pose.copy(), pose.replace()):
        assert again == pose and again is not pose
        again.time_stamp.day = 4
        assert pose.time_stamp.day == 3
    assert pose.replace(x_m=2) == Pose(x_m=2, time_stamp=Pose.TimeStamp(day=3))
    assert pose.x_m == 1
    for value in (pose, pose.x, pose.time_stamp, core.QueryIdentification.QueryType(1), Pose):
        again = pickle.loads(pickle.dumps(value))
        assert again == value and type(again) is type(value)
    with pytest.raises(TypeError, match="did you mean x_m?"):
        pose.replace(x_meter=1)
    assert pose != Pose() and pose != 1
    with pytest.raises(TypeError, match="unhashable"):
        hash(pose)


def test_the_representation_is_a_call_of_the_constructor():
    pose = Pose(x_m=2.5, time_stamp=Pose.TimeStamp(day=3))
    assert repr(pose) == (
        "ReportLocalPose(x_m=2.5, time_stamp=TimeStamp("
        "milliseconds=0, seconds=0, minutes=0, hour=0, day=3))"
    )


def test_a_notebook_shows_a_table_of_field_value_and_unit():
    table = Pose(x_m=2.5, time_stamp=Pose.TimeStamp(day=3))._repr_html_()
    assert "<td style='text-align:left'>x_m</td>" in table
    assert "2.5</td><td>meter</td>" in table
    assert "time_stamp.day" in table
    hostile = core.ReportIdentification(query_type=1, type=1, identification="<script>")
    assert "<script>" not in hostile._repr_html_()


def test_help_shows_fields_with_units_and_ranges():
    text = pydoc.plain(pydoc.render_doc(Pose))
    for part in ("x_m: float", "X: meter, -100000 to 100000", "ReportLocalPose (4403h)"):
        assert part in text
    assert "x_m" in inspect.signature(Pose).parameters
    parameter = inspect.signature(mobility.SetGlobalWaypoint).parameters["latitude_deg"]
    assert parameter.default is inspect.Parameter.empty


def test_the_errors_of_the_package_are_value_errors():
    for error in (FieldError("a", "b", "c"), DecodeError("a", "b", "c", 4)):
        assert isinstance(error, ValueError) and isinstance(error, jaus.errors.Error)
        again = pickle.loads(pickle.dumps(error))
        assert (str(again), again.path) == (str(error), error.path)

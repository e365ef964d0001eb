"""Events of a record: fields become text, and the text becomes fields."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from suave_des.events import (
    BatteryCrossing,
    ComponentStatus,
    ModeRefused,
    ModeRequested,
    ModeSet,
    PipelineDetected,
    Said,
    VisibilityCrossing,
    name_of,
    read,
    texts_of,
)

NAMES = st.from_regex(r"[a-z_0-9.]+", fullmatch=True)
KINDS = (ModeRequested, ModeRefused, ModeSet, ComponentStatus, VisibilityCrossing, BatteryCrossing)


@pytest.mark.parametrize(
    ("happening", "texts"),
    [
        (ModeRequested("f_motion", "fd_all"), ("mode_requested", "f_motion -> fd_all")),
        (ModeRefused("f_motion", "fd_al"), ("refused", "f_motion -> fd_al")),
        (ModeSet("f_motion", "fd_all"), ("mode_set", "f_motion = fd_all")),
        (ComponentStatus("c_thruster_1", "FALSE"), ("component_status", "c_thruster_1 FALSE")),
        (PipelineDetected(17), ("pipeline_detected", "point 17")),
        (
            VisibilityCrossing("rises to 3.25 m", "3.30 m"),
            ("visibility_crossing", "rises to 3.25 m (3.30 m)"),
        ),
        (
            BatteryCrossing("falls below 0.25", "0.24"),
            ("battery_crossing", "falls below 0.25 (0.24)"),
        ),
        (Said("mission_ended", "time is over"), ("mission_ended", "time is over")),
    ],
)
def test_each_is_written_as_a_name_with_a_text(happening, texts):
    assert tuple(texts_of(happening)) == texts


@given(st.sampled_from(KINDS), NAMES, NAMES)
def test_fields_are_read_back_from_the_text(kind, first, second):
    happening = kind(first, second)
    name, detail = texts_of(happening)
    assert name == name_of(kind)
    assert read(kind, detail) == happening


@given(st.integers(0, 99_999))
def test_a_number_is_read_back_as_a_number(point):
    _, detail = texts_of(PipelineDetected(point))
    assert read(PipelineDetected, detail) == (point,)


@pytest.mark.parametrize(
    ("kind", "detail"),
    [(ModeSet, "f_motion -> fd_all"), (ComponentStatus, "hull"), (PipelineDetected, "point x")],
)
def test_a_text_of_another_kind_is_not_read(kind, detail):
    assert read(kind, detail) is None

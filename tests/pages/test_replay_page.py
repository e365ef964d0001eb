"""The replay, opened in a browser as a reader would."""

import pytest

from suave_des.pages.replay import replay_page
from suave_des.records.mission_folder import record_of
from suave_des.results.mission import adaptations
from suave_des.scenario.loader import load_scenario
from suave_des.simulation.simulator import Simulator
from tests.helpers.browser import DESKTOP, PHONE, opened

SEED = 1
FAILURE_S = 36.0  # when metacontrol has seen the thruster's failure of seams2023


@pytest.fixture(scope="module")
def missions():
    loaded = load_scenario("seams2023")
    simulator = Simulator(loaded)
    return {
        name: record_of(simulator.run(name, 1, SEED, record=True), loaded)
        for name in ("metacontrol", "none")
    }


@pytest.fixture(scope="module")
def one(missions, tmp_path_factory):
    file = tmp_path_factory.mktemp("one") / "replay.html"
    file.write_text(replay_page([missions["metacontrol"]]), encoding="utf-8")
    return file


@pytest.fixture(scope="module")
def both(missions, tmp_path_factory):
    file = tmp_path_factory.mktemp("both") / "replay.html"
    file.write_text(replay_page([missions["metacontrol"], missions["none"]]), encoding="utf-8")
    return file


@pytest.fixture(scope="module")
def opened_one(one, browser):
    """A paused replay, for those who move through its time."""
    with opened(browser, one) as found:
        yield found


def place(found, pane=0):
    return found.value(
        f"Object.values(document.querySelectorAll('.pane')[{pane}].dataset).map(Number)"
    )


def mission_time(found):
    return float(found.value("document.body.dataset.time"))


def colours(found, canvas):
    """How many different colours a canvas shows."""
    return found.value(
        f"""(() => {{ const c = document.querySelector('{canvas}'), d = c.getContext('2d');
        const p = d.getImageData(0, 0, c.width, c.height).data, seen = new Set();
        for (let i = 0; i < p.length; i += 4 * 7) seen.add((p[i] << 16) | (p[i + 1] << 8) | p[i + 2]);
        return seen.size; }})()"""
    )


@pytest.fixture(
    scope="module",
    params=[("one", DESKTOP), ("both", PHONE), ("one", PHONE)],
    ids=["one on a desktop", "two on a phone", "one on a phone"],
)
def window(request, browser):
    """A replay in a window, its file, and the window's width."""
    name, size = request.param
    file = request.getfixturevalue(name)
    with opened(browser, file, size, f"#t={FAILURE_S}") as found:
        yield found, file, size[0]


def test_it_opens_without_complaint(window):
    found, _, _ = window
    assert found.complaints == []


def test_it_opens_without_request(window):
    found, file, _ = window
    assert found.outside(file) == []


def test_it_is_not_wider_than_the_window(window):
    found, _, width = window
    assert found.value("document.documentElement.scrollWidth") <= width


@pytest.mark.parametrize(
    ("canvas", "fewest"),
    [("canvas.scene", 300), ("canvas.map", 10), ("canvas.profile", 10), ("#timeline", 10)],
)
def test_it_draws(window, canvas, fewest):
    found, _, _ = window
    assert colours(found, canvas) > fewest


def test_it_opens_within_a_second(one, browser):
    """By the main thread's own time: other programs may be using the machine."""
    with opened(browser, one) as found:
        metrics = found.page.context.new_cdp_session(found.page)
        metrics.send("Performance.enable", {"timeDomain": "threadTicks"})
        found.page.reload()
        taken = {
            each["name"]: each["value"]
            for each in metrics.send("Performance.getMetrics")["metrics"]
        }
        assert 0.0 < taken["TaskDuration"] < 1.0


def test_playing_moves_the_vehicle_until_it_is_paused(opened_one):
    scrub_to(opened_one, 10)
    start = place(opened_one)
    opened_one.page.click("#play")
    opened_one.wait_until("Number(document.body.dataset.time) > 12")
    assert place(opened_one) != start
    opened_one.page.click("#play")
    paused = mission_time(opened_one)
    opened_one.page.wait_for_timeout(150)
    assert mission_time(opened_one) == pytest.approx(paused, abs=0.2)


def scrub_to(found, time_s):
    found.page.evaluate(
        f"(s => {{ s.value = {time_s}; s.dispatchEvent(new Event('input')); }})(document.querySelector('#scrub'))"
    )
    found.wait_until(f"document.body.dataset.time === '{time_s}.00'")


def test_scrubbing_shows_the_vehicle_where_it_was_then(opened_one, missions):
    track = missions["metacontrol"].trajectory
    index = track["t_s"].tolist().index(50.0)
    scrub_to(opened_one, 50)
    assert place(opened_one) == pytest.approx(
        [track[name][index] for name in ("x_m", "y_m", "z_m")], abs=2e-3
    )


@pytest.mark.parametrize(
    ("key", "expected_s"),
    [("ArrowRight", 101.0), ("Shift+ArrowLeft", 90.0), ("End", 300.0), ("Home", 0.0)],
)
def test_keys_move_through_time(key, expected_s, opened_one):
    scrub_to(opened_one, 100)
    opened_one.page.keyboard.press(key)
    opened_one.wait_until(f"Math.abs(Number(document.body.dataset.time) - {expected_s}) < 0.5")


def test_the_next_key_stops_at_adaptations_alone(opened_one, missions):
    scrub_to(opened_one, 0)
    for adaptation in adaptations(missions["metacontrol"])[:3]:
        opened_one.page.keyboard.press("n")
        opened_one.wait_until(
            f"Math.abs(Number(document.body.dataset.time) - {adaptation.t_s}) < 0.05"
        )


def test_the_legend_names_the_marks_of_the_timeline(opened_one):
    legend = opened_one.page.text_content("#legend")
    assert all(
        word in legend for word in ("adaptation", "thruster fails", "pipeline found", "visibility")
    )


def test_the_space_bar_is_the_play_button_wherever_the_focus_is(opened_one):
    scrub_to(opened_one, 0)
    opened_one.value("document.activeElement.blur()")
    opened_one.page.keyboard.press(" ")
    assert opened_one.value("document.body.classList.contains('playing')")
    opened_one.page.focus("#play")
    opened_one.page.keyboard.press(" ")
    assert not opened_one.value("document.body.classList.contains('playing')")


class TestPanelOfAnAdaptation:
    @pytest.fixture
    def panel(self, opened_one):
        scrub_to(opened_one, int(FAILURE_S))
        return opened_one.page.text_content

    @pytest.mark.parametrize(
        ("phase", "words"),
        [
            ("analyze", "IN_ERROR_COMPONENT"),
            ("analyze", "by rule compErrFG"),
            ("analyze", "?c = c_thruster_1"),
            ("plan", "left out: not realisable"),
        ],
    )
    def test_shows_what_was_inferred(self, panel, phase, words):
        assert words in panel(f".{phase}")

    def test_shows_the_design_that_was_chosen(self, panel):
        assert panel(".designs .chosen .name") == "fd_recover_thrusters"

    def test_shows_which_thruster_has_failed(self, panel, opened_one):
        assert opened_one.value("document.querySelectorAll('.lamps .dead').length") == 1


def test_two_managers_play_side_by_side_on_the_same_numbers(both, browser):
    with opened(browser, both, hash_="#t=0.0") as found:
        assert place(found, 0) == place(found, 1)
        assert "the same random numbers" in found.page.text_content("#subtitle")
        found.page.keyboard.press("End")
        found.wait_until("Number(document.body.dataset.time) > 299")
        assert place(found, 0) != place(found, 1)


IN_SIGHT = """(inner, phase) => {
  const box = document.querySelector(`.phase.${phase}`).getBoundingClientRect();
  const shown = document.querySelector(`.phase.${phase} ${inner}`).getBoundingClientRect();
  const deck = document.querySelector('.deck').getBoundingClientRect();
  return shown.bottom <= Math.min(box.bottom, deck.top) + 1;
}"""


@pytest.fixture(
    scope="module",
    params=[
        ("one", (1024, 768), True),
        ("both", DESKTOP, False),
        ("both", (1920, 1080), False),
        ("both", (1920, 1080), True),
        ("both", (1280, 800), True),
        ("both", (1366, 768), True),
    ],
    ids=str,
)
def projected(request, browser):
    """A replay on a projector, of a size, and enlarged or not."""
    name, size, is_enlarged = request.param
    page = request.getfixturevalue(name)
    with opened(browser, page, size, hash_=f"#t={FAILURE_S + 1.0}") as found:
        if is_enlarged:
            found.page.keyboard.press("b")
        yield found


@pytest.mark.parametrize(("phase", "inner"), [("analyze", ".fact .by"), ("plan", ".chosen .name")])
def test_a_phase_of_the_loop_is_in_sight_on_a_projector(projected, phase, inner):
    assert projected.value(f"({IN_SIGHT})('{inner}', '{phase}')")


def test_a_key_enlarges_all_for_a_projector(opened_one):
    zoom = "getComputedStyle(document.body).zoom"
    opened_one.page.keyboard.press("b")
    enlarged = opened_one.value(zoom)
    opened_one.page.keyboard.press("b")
    assert (enlarged, opened_one.value(zoom)) == ("1.4", "1")


def test_it_says_when_no_design_is_left(tmp_path, browser):
    rules, file = tmp_path / "stay.swrl", tmp_path / "replay.html"
    rules.write_text(
        "stay: typeFD(?fg, fd_spiral_medium) -> fd_realisability(fd_spiral_low, false)"
    )
    loaded = load_scenario("seams2023", rules=[rules])
    result = Simulator(loaded).run("metacontrol", 1, SEED, record=True)
    file.write_text(replay_page([record_of(result, loaded)]), encoding="utf-8")
    with opened(browser, file, hash_="#t=30") as found:
        assert found.complaints == []
        assert "no design is left for f_generate_search_path" in found.page.text_content(".state")
        assert "no design left" in found.page.text_content("#legend")


def test_names_are_text_never_markup(missions, tmp_path, browser):
    from dataclasses import replace

    name = "</script><img src=x onerror=alert(1)><b>mine</b>"
    mission = replace(missions["none"], metrics={**missions["none"].metrics, "manager": name})
    file = tmp_path / "replay.html"
    file.write_text(replay_page([mission]), encoding="utf-8")
    with opened(browser, file) as found:
        assert found.complaints == []
        assert found.page.text_content("h1") == name
        assert found.value("document.querySelectorAll('img, h1 b').length") == 0


EXPLAINS = ".mind, .legend, #subtitle, .figure:has(.mode)"
EXPLAINING = (
    f"[...document.querySelectorAll('{EXPLAINS}')].filter(each => each.checkVisibility()).length"
)


@pytest.fixture(scope="module")
def hidden_for_a_while(one, browser):
    """Number of what explains the mission, and of colours of the timeline: before a key is pressed,
    after it, and when it was pressed again.
    """
    seen = []
    with opened(browser, one, hash_=f"#t={FAILURE_S}") as found:
        for _ in range(3):
            found.page.wait_for_timeout(200)
            seen.append((found.value(EXPLAINING), colours(found, "#timeline")))
            found.page.keyboard.press("w")
    return seen


def test_a_key_hides_all_that_explains_the_mission_for_a_while(hidden_for_a_while):
    assert [explaining for explaining, _ in hidden_for_a_while] == [4, 0, 4]


def test_the_key_hides_what_is_to_come(hidden_for_a_while):
    (_, before), (_, hidden), _ = hidden_for_a_while
    assert hidden < before / 2


def test_the_key_hides_the_panels_of_two_missions_too(both, browser):
    with opened(browser, both) as found:
        found.page.keyboard.press("w")
        found.wait_until("document.documentElement.classList.contains('wordless')")
        panels = "[...document.querySelectorAll('.mind')].map(each => each.checkVisibility())"
        assert found.value(panels) == [False, False]


def test_with_two_missions_in_a_low_window_readings_stand_below_the_picture(both, browser):
    place = "document.querySelector('{}').getBoundingClientRect()"
    with opened(browser, both, DESKTOP) as found:
        readings = found.value(f"{place.format('.hud.bottom')}.top")
        picture = found.value(f"{place.format('canvas.scene')}.bottom")
        side = found.value(f"{place.format('.side')}.top")
        bottom = found.value(f"{place.format('.hud.bottom')}.bottom")
    assert picture <= readings + 1 and bottom <= side + 1

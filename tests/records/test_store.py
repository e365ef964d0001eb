"""The store of a campaign keeps outcomes, whatever ends its process, and says what is wrong with
it.
"""

import json
from contextlib import closing
from pathlib import Path

import pytest

from suave_des.errors import InputError
from suave_des.files import csv_pieces
from suave_des.records import store as stores
from suave_des.records.contents import Manifest
from suave_des.records.metrics import COLUMN_TYPES
from suave_des.records.store import (
    ENSEMBLE_FILE,
    MANIFEST_FILE,
    RUNS_FILE,
    STORE_FILE,
    SUAVE_FOLDER,
    MissionFailure,
    MissionKey,
    MissionOutcome,
    Store,
    StoreError,
    has_campaign,
    is_left_over,
    read_manifest,
    tidy,
    write_campaign,
)

FIRST, SECOND, THIRD = (MissionKey(0, 0, run) for run in (1, 2, 3))
_CELLS = {"str": "sea", "int": 1, "float": 87.5, "bool": True}
ROW = (*(_CELLS[kind] for kind in COLUMN_TYPES.values()), None, 0.25)
"""Of runs.csv, with two columns of what was drawn."""
PASSING = MissionFailure("none", 2, 50.0, "not done after 2 s (time-out)", lasting=False)
LASTING = MissionFailure("none", 3, None, "ValueError: no", point=4)


@pytest.fixture
def store(tmp_path: Path):
    """A store of a campaign that has begun."""
    with closing(Store(tmp_path / STORE_FILE)) as opened:
        opened.begin({"identity": "one"})
        yield opened


def kept(store: Store) -> list[MissionOutcome]:
    """All outcomes of a store, whatever campaign they are of."""
    return list(store.outcomes(lambda outcome: ""))


def test_outcomes_come_back_in_the_order_of_their_keys(store):
    found = [(THIRD, LASTING), (FIRST, ROW), (SECOND, PASSING)]
    store.append(found)
    assert kept(store) == sorted(found, key=lambda each: each[0])


def test_an_outcome_takes_the_place_of_an_earlier_one_of_its_mission(store):
    store.append([(FIRST, PASSING)])
    store.append([(FIRST, ROW)])
    assert kept(store) == [(FIRST, ROW)]


def test_only_failures_that_may_not_recur_are_forgotten(store):
    store.append([(FIRST, ROW), (SECOND, PASSING), (THIRD, LASTING)])
    store.forget_passing_failures()
    assert [key for key, _ in kept(store)] == [FIRST, THIRD]


def test_an_outcome_that_the_campaign_cannot_have_is_damage(store):
    store.append([(FIRST, ROW), (SECOND, ROW)])
    outcomes = store.outcomes(lambda outcome: "it has run 2" if outcome[0] == SECOND else "")
    assert next(outcomes) == (FIRST, ROW)
    with pytest.raises(InputError, match="is damaged: it has run 2"):
        next(outcomes)


def test_settled_are_the_runs_of_one_manager_at_one_point(store):
    others = [MissionKey(0, 1, 5), MissionKey(1, 0, 6)]
    store.append([(key, ROW) for key in (FIRST, THIRD, *others)])
    assert store.settled(0, 0) == {1, 3}


def test_what_is_noted_is_found_under_its_name(store):
    store.note("identity", {"runs": 3})
    assert store.about("identity") == {"runs": 3}


def test_unless_there_is_a_default(store):
    assert store.about("remarks", default=["none"]) == ["none"]


def test_a_closed_store_can_still_be_read(tmp_path):
    with closing(Store(tmp_path / STORE_FILE)) as opened:
        opened.begin({})
        opened.append([(FIRST, ROW)])
    assert kept(opened) == [(FIRST, ROW)]


def test_a_closed_store_is_one_file(tmp_path):
    with closing(Store(tmp_path / STORE_FILE)) as opened:
        opened.begin({})
    assert [path.name for path in tmp_path.iterdir()] == [STORE_FILE]


def test_one_that_has_no_outcome_is_removed_if_that_is_asked_for(tmp_path):
    opened = Store(tmp_path / STORE_FILE)
    opened.begin({})
    opened.close(keep_empty=False)
    assert not (tmp_path / STORE_FILE).exists()


def test_one_that_has_outcomes_is_not(tmp_path):
    opened = Store(tmp_path / STORE_FILE)
    opened.begin({})
    opened.append([(FIRST, ROW)])
    opened.close(keep_empty=False)
    assert (tmp_path / STORE_FILE).exists()


def test_a_store_begins_anew_in_place_of_an_earlier_campaign(tmp_path):
    with closing(Store(tmp_path / STORE_FILE)) as earlier:
        earlier.begin({"identity": "one"})
        earlier.append([(FIRST, ROW)])
    with closing(Store(tmp_path / STORE_FILE)) as later:
        later.begin({"identity": "two"})
        assert (later.count(), later.about("identity")) == (0, "two")


@pytest.fixture
def closed(tmp_path: Path) -> Path:
    """The folder of a store with an outcome."""
    with closing(Store(tmp_path / STORE_FILE)) as opened:
        opened.begin({"identity": "one"})
        opened.append([(FIRST, ROW)])
    return tmp_path


def test_it_is_replaced_only_if_that_is_asked_for(tmp_path):
    (tmp_path / STORE_FILE).write_text("my notes " * 100)
    with closing(Store(tmp_path / STORE_FILE, replace=True)) as opened:
        assert opened.is_new


def test_a_store_whose_file_was_removed_can_keep_nothing(tmp_path):
    with closing(Store(tmp_path / STORE_FILE)) as opened:
        opened.begin({})
        (tmp_path / STORE_FILE).unlink()
        with pytest.raises(StoreError, match="was removed while the campaign ran"):
            opened.commit()


def test_outcomes_are_durable_after_a_while_without_being_asked(tmp_path, monkeypatch):
    now_s = iter([0.0, 0.0, stores._COMMIT_PERIOD_S + 1.0, 2.0])
    monkeypatch.setattr(stores.time, "monotonic", lambda: next(now_s))
    opened = Store(tmp_path / STORE_FILE)
    opened.begin({})
    opened.append([(FIRST, ROW)])
    opened.append([(SECOND, ROW)])
    opened._db.execute("ROLLBACK")  # what a kill loses
    opened._db.execute("BEGIN")
    assert opened.count() == 2
    opened.close()


def test_a_folder_has_a_campaign_from_its_beginning_on(closed):
    assert has_campaign(closed)


def test_a_folder_in_which_none_was_begun_has_none(tmp_path):
    Store(tmp_path / STORE_FILE).close()
    assert not has_campaign(tmp_path)


def test_one_that_is_in_use_counts_as_a_campaign(store, tmp_path):
    store.append([(FIRST, ROW)])
    store.commit()  # into a journal, which no other process may read now
    assert has_campaign(tmp_path)


def test_a_damaged_store_counts_as_a_campaign(tmp_path):
    (tmp_path / STORE_FILE).write_text("my notes " * 100)
    assert has_campaign(tmp_path)


def test_only_files_of_the_database_are_left_over():
    names = (f"{STORE_FILE}-wal", STORE_FILE, RUNS_FILE)
    assert [is_left_over(name) for name in names] == [True, True, False]


# The files beside it.


def test_what_was_drawn_has_all_its_digits_in_runs_csv():
    _, line = "".join(csv_pieces(("a", "b"), [(0.1234567890123456, "low")])).splitlines()
    assert line == "0.1234567890123456,low"


def written(folder, about, files, suave):
    """Write the files of a campaign beside its store."""
    with closing(Store(folder / STORE_FILE)) as store:
        if store.is_new:
            store.begin({})
        write_campaign(store, about, files, suave)


def test_files_of_an_earlier_campaign_that_are_not_written_again_are_gone(tmp_path):
    written(tmp_path, {}, {RUNS_FILE: "a", ENSEMBLE_FILE: "a"}, {})
    written(tmp_path, {}, {RUNS_FILE: "b"}, {})
    assert {path.name for path in tmp_path.iterdir()} == {STORE_FILE, RUNS_FILE, MANIFEST_FILE}


def test_files_that_are_written_again_take_the_place_of_the_earlier_ones(tmp_path):
    written(tmp_path, {}, {RUNS_FILE: "a"}, {})
    written(tmp_path, {}, {RUNS_FILE: "b"}, {})
    assert (tmp_path / RUNS_FILE).read_text() == "b"


def test_the_manifest_adds_the_hash_of_each_file_to_what_is_known(tmp_path):
    written(tmp_path, {"seed": 1}, {RUNS_FILE: "abc"}, {"none_suave.csv": ""})
    assert json.loads((tmp_path / MANIFEST_FILE).read_text()) == {
        "seed": 1,
        "files_sha256": {  # as sha256sum prints them
            RUNS_FILE: "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad",
            f"{SUAVE_FOLDER}/none_suave.csv": (
                "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"
            ),
        },
    }


def test_the_exemplars_files_have_a_folder_of_their_own(tmp_path):
    written(tmp_path, {}, {RUNS_FILE: "a"}, {"none_suave.csv": "b"})
    assert (tmp_path / SUAVE_FOLDER / "none_suave.csv").read_text() == "b"


def test_which_is_gone_when_a_campaign_has_none(tmp_path):
    written(tmp_path, {}, {RUNS_FILE: "a"}, {"none_suave.csv": "b"})
    written(tmp_path, {}, {RUNS_FILE: "a"}, {})
    assert not (tmp_path / SUAVE_FOLDER).exists()


def test_unless_the_user_has_put_something_into_it(tmp_path):
    written(tmp_path, {}, {RUNS_FILE: "a"}, {"none_suave.csv": "b"})
    (tmp_path / SUAVE_FOLDER / "notes.txt").write_text("mine")
    written(tmp_path, {}, {RUNS_FILE: "a"}, {})
    assert [path.name for path in (tmp_path / SUAVE_FOLDER).iterdir()] == ["notes.txt"]


@pytest.mark.parametrize(
    ("is_new", "left"), [(True, [STORE_FILE]), (False, [STORE_FILE, MANIFEST_FILE, RUNS_FILE])]
)
def test_the_results_of_an_earlier_campaign_are_removed_before_a_new_one(tmp_path, is_new, left):
    written(tmp_path, {}, {RUNS_FILE: "a"}, {})
    with closing(Store(tmp_path / STORE_FILE)) as store:
        tidy(store, is_new=is_new)
    assert sorted(path.name for path in tmp_path.iterdir()) == left


def test_but_not_what_the_user_has_changed_in_them(tmp_path):
    written(tmp_path, {}, {RUNS_FILE: "a"}, {})
    (tmp_path / RUNS_FILE).write_text("mine")
    with closing(Store(tmp_path / STORE_FILE)) as store:
        tidy(store, is_new=True)
    assert (tmp_path / RUNS_FILE).read_text() == "mine"


def test_a_folder_without_a_manifest_has_an_empty_one(tmp_path):
    assert read_manifest(tmp_path) == Manifest()


def test_a_manifest_of_the_campaign_that_is_kept_is_read(closed):
    manifest = {"campaign_sha256": "one", "runs_per_draw": 3}
    (closed / MANIFEST_FILE).write_text(json.dumps(manifest))
    assert read_manifest(closed) == Manifest(**manifest)

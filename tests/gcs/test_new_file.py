"""A file has its name when it is complete, and leaves nothing when it is not."""

import pytest

from mavherd.gcs.new_file import new_file, write_text


def test_it_has_its_name_at_the_end_and_not_before(tmp_path):
    path = tmp_path / "table.parquet"
    with new_file(path) as part:
        part.write_text("new")
        assert not path.exists()
    assert [each.name for each in tmp_path.iterdir()] == ["table.parquet"]
    assert path.read_text() == "new"


def fail(path, error):
    with new_file(path) as part:
        part.write_text("ha")
        raise error


@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), KeyboardInterrupt()])
def test_what_was_broken_off_leaves_the_old_one_and_nothing_else(tmp_path, error):
    path = tmp_path / "table.parquet"
    write_text(path, "old")
    with pytest.raises(type(error)):
        fail(path, error)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]

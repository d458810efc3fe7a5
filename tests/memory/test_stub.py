from escort_mj.memory.stub import STUB, stub


def test_type_checkers_read_the_fields_that_components_declare() -> None:
    assert STUB.read_text(encoding="utf-8") == stub(), "write it anew: python -m escort_mj.memory.stub"

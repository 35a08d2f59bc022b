import ast
import pathlib

import bslam
import pytest

FOLDER = pathlib.Path(bslam.__file__).parent
STUB = ast.parse((FOLDER / "_bslam.pyi").read_text())


def test_package_is_typed():
    declared = {node.name for node in STUB.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
    assert (FOLDER / "py.typed").exists()
    assert declared >= {name for name in bslam.__all__ if hasattr(bslam._bslam, name)} - {"__version__"}


def test_types_in_the_stub_are_those_of_python():
    assert "::" not in ast.unparse(STUB)


@pytest.mark.parametrize("name", [name for name in bslam.__all__ if name != "__version__"])
def test_public_names_are_documented(name):
    assert getattr(bslam, name).__doc__


def test_errors_name_the_package():
    assert bslam.Error.__module__ == bslam.Rig.__module__ == bslam.evaluate.__module__ == "bslam"

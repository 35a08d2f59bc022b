import ast
import pathlib

import bslam
import pytest

FOLDER = pathlib.Path(bslam.__file__).parent
STUB = ast.parse((FOLDER / "_bslam.pyi").read_text())
DEFINITIONS = (ast.ClassDef, ast.FunctionDef)


def test_package_is_typed():
    declared = {node.name for node in STUB.body if isinstance(node, DEFINITIONS)}
    assert (FOLDER / "py.typed").exists()
    assert declared >= {name for name in bslam.__all__ if hasattr(bslam._bslam, name)} - {"__version__"}


def test_types_in_the_stub_are_those_of_python():
    assert "::" not in ast.unparse(STUB)


def public_definitions(tree, prefix=""):
    """Names and definitions of classes, functions, methods and properties."""
    for node in tree.body:
        if isinstance(node, DEFINITIONS) and (node.name == "__init__" or not node.name.startswith("_")):
            yield prefix + node.name, node
            if isinstance(node, ast.ClassDef):
                yield from public_definitions(node, f"{prefix}{node.name}.")


def test_every_public_name_is_documented():
    found = dict(public_definitions(STUB))
    for file in FOLDER.glob("*.py"):
        found |= public_definitions(ast.parse(file.read_text()))
    assert {"System.process", "Map.covisibility", "Frame.time_ns", "evaluate", "simulate"} <= found.keys()
    assert [name for name, node in found.items() if not ast.get_docstring(node)] == []


def test_public_names_are_in_the_documentation():
    file = pathlib.Path(__file__).parents[2] / "docs/python.md"
    text = file.read_text()
    results = {"Setting", "Statistics", "__version__"}  # of settings() and evaluate(), which are there
    assert [name for name in bslam.__all__ if name not in text and name not in results] == []
    members = {name.split(".")[1] for name, _ in public_definitions(STUB) if name.startswith(("System.", "Map."))}
    assert [name for name in sorted(members) if name not in text and name != "__init__"] == []


def test_arrays_are_documented_with_their_shapes():
    for name, node in public_definitions(STUB):
        if isinstance(node, ast.FunctionDef) and node.returns and "NDArray" in ast.unparse(node.returns):
            assert "(" in ast.get_docstring(node), name


@pytest.mark.parametrize("name", [name for name in bslam.__all__ if name != "__version__"])
def test_public_names_are_documented(name):
    assert getattr(bslam, name).__doc__


def test_errors_name_the_package():
    assert bslam.Error.__module__ == bslam.Rig.__module__ == bslam.evaluate.__module__ == "bslam"

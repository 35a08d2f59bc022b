"""Packages from PyPI for a test, in a virtual environment of their own."""
import importlib.util
import pathlib
import subprocess
import sys


def python_of(venv):
    return pathlib.Path(venv, 'bin/python')


def pip_command(venv):
    """Makes an environment. Returns the start of commands of pip for it: by the pip of this interpreter, since installing
    another one takes longer than some packages do."""
    if importlib.util.find_spec('pip'):
        import pip
        if tuple(int(part) for part in pip.__version__.split('.')[:2]) >= (22, 3):
            subprocess.run([sys.executable, '-m', 'venv', '--without-pip', venv], check=True, capture_output=True, text=True)
            return [sys.executable, '-m', 'pip', '--python', python_of(venv)]
    subprocess.run([sys.executable, '-m', 'venv', venv], check=True, capture_output=True, text=True)
    return [python_of(venv), '-m', 'pip']


def install(venv, *packages):
    """None, or why they cannot be installed. Only those modules are compiled which are then imported."""
    try:
        subprocess.run([*pip_command(venv), 'install', '--quiet', '--disable-pip-version-check', '--no-compile', *packages], check=True,
                       capture_output=True, text=True)
    except subprocess.CalledProcessError as failed:
        return (failed.stderr.strip() or failed.stdout.strip() or 'no message').splitlines()[-1]
    return None

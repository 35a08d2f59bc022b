"""Common functions of the tests of the checking scripts: small source trees, and the scripts as modules."""
import atexit
import importlib.machinery
import importlib.util
import pathlib
import shutil
import subprocess
import sys
import tempfile

SCRIPTS = pathlib.Path(__file__).resolve().parents[2] / 'scripts'
sys.dont_write_bytecode = True


def load(name):
    """Returns the script as a module without running its main()."""
    loader = importlib.machinery.SourceFileLoader(name, str(SCRIPTS / name))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(name, loader))
    loader.exec_module(module)
    return module


class Tree:
    """A temporary project: Tree({'src/a/b.h': 'text'}); removed at the end of the program."""

    def __init__(self, files):
        self.root = pathlib.Path(tempfile.mkdtemp(prefix='bslam_scripts_'))
        atexit.register(shutil.rmtree, self.root)
        for name, text in files.items():
            path = self.root / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)

    def run(self, script, *arguments):
        """Runs a script on this tree and returns (exit status, printed lines)."""
        command = [sys.executable, str(SCRIPTS / script), '--root', str(self.root), *arguments]
        done = subprocess.run(command, capture_output=True, text=True)
        return done.returncode, (done.stdout + done.stderr).splitlines()

#!/usr/bin/env python3
"""Renders a short recording, runs `bslam run`, and opens report.html in a headless browser, in light and dark and in a narrow window.

    page_in_browser.py BSLAM [--keep DIR]

Exit 0: the page reports no errors, draws its charts and its 3D view, and is as wide as the window; 1: it does not; 77: skipped,
there is no Chromium. --keep DIR leaves recording, report and screenshots there.
"""
import argparse
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

SKIPPED = 77
FLAGS = ['--headless=new', '--no-sandbox', '--disable-gpu', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
         '--hide-scrollbars', '--virtual-time-budget=8000', '--enable-logging=stderr', '--v=0']
# Writes what it finds into the title, which is part of the printed document.
PROBE = '''<script>setTimeout(() => {
  const canvas = document.querySelector('.view canvas'), small = document.createElement('canvas').getContext('2d');
  small.drawImage(canvas, 0, 0, 64, 64);
  const pixels = small.getImageData(0, 0, 64, 64).data, colours = new Set();
  for (let i = 0; i < pixels.length; i += 4) colours.add(`${pixels[i]},${pixels[i + 1]},${pixels[i + 2]}`);
  const wide = document.documentElement.scrollWidth > innerWidth;
  document.title = `probe charts=${document.querySelectorAll('.uplot canvas').length} colours=${colours.size} wide=${wide}`;
}, 2000);</script>'''


def run(*command):
    subprocess.run([str(word) for word in command], check=True, stdout=subprocess.DEVNULL)


def browse(browser, page, width, dark, screenshot):
    """Returns the messages of errors, and the title of the page."""
    command = [browser, *FLAGS, f'--window-size={width},1600', *(['--force-dark-mode'] if dark else [])]
    shown = subprocess.run([*command, '--dump-dom', page.as_uri()], capture_output=True, text=True, timeout=180)
    subprocess.run([*command, f'--screenshot={screenshot}', page.as_uri()], capture_output=True, timeout=180)
    errors = [line for line in shown.stderr.splitlines() if 'CONSOLE' in line and ('Uncaught' in line or 'Error' in line or 'ERROR' in line)]
    title = re.search(r'<title>(.*?)</title>', shown.stdout)
    return errors, title[1] if title else ''


def check(bslam, browser, folder):
    run(bslam, 'simulate', '--out', folder / 'data', '--duration', 2, '--rate', 10, '--progress', 'never', '--overwrite')
    run(bslam, 'run', folder / 'data', '--out', folder / 'run', '--mode', 'sequential', '--progress', 'never', '--overwrite')
    page = folder / 'page.html'
    page.write_text((folder / 'run' / 'report.html').read_text().replace('</body>', PROBE + '</body>'))
    failed = False
    for width, dark in ((1400, False), (1400, True), (500, False)):
        errors, title = browse(browser, page, width, dark, folder / f'report_{width}_{"dark" if dark else "light"}.png')
        found = dict(item.split('=') for item in title.split()[1:] if '=' in item)
        fine = not errors and int(found.get('charts', 0)) >= 5 and int(found.get('colours', 0)) >= 20 and found.get('wide') == 'false'
        print(f'{width} px, {"dark" if dark else "light"}: {"fine" if fine else "wrong"}: {title} {errors}')
        failed |= not fine
    return 1 if failed else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('bslam', type=pathlib.Path)
    parser.add_argument('--keep', type=pathlib.Path)
    arguments = parser.parse_args()
    browser = shutil.which('chromium') or shutil.which('chromium-browser') or shutil.which('google-chrome')
    if not browser:
        print('skipped: there is no Chromium')
        return SKIPPED
    if arguments.keep:
        arguments.keep.mkdir(parents=True, exist_ok=True)
        return check(arguments.bslam, browser, arguments.keep.resolve())
    with tempfile.TemporaryDirectory() as folder:
        return check(arguments.bslam, browser, pathlib.Path(folder))


if __name__ == '__main__':
    sys.exit(main())

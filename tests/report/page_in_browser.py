#!/usr/bin/env python3
"""Renders a short recording, runs `bslam run`, and opens report.html in a headless browser, in light and dark and in a narrow window;
then the same for the live view of a run.

    page_in_browser.py BSLAM [--keep DIR]

Exit 0: the page reports no errors, draws its charts and its 3D view, and is as wide as the window; 1: it does not; 77: skipped,
there is no Chromium. --keep DIR leaves recording, report and screenshots there.
"""
import argparse
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / 'live_view'))
from browser_connection import Browser, View  # noqa: E402

SKIPPED = 77
RIG = pathlib.Path(__file__).resolve().parents[1] / 'support/ring.yaml'
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


# The data of a live view and then those of the report: another drawing of the same page. Writes whether the point of view, the focus and
# the elements have remained.
LIVE_PROBE = '''<script>
const settled = () => new Promise((resolve) => setTimeout(resolve, 400));
const picture = () => document.querySelector('.view canvas').toDataURL();
setTimeout(async () => {
  const report = JSON.stringify(REPORT), show = (change) => {
    const run = bslam.parse(report);
    change(run);
    bslam.show(run);
  };
  const live = (run) => { run.live = true; run.truth = null; };
  show(live);
  await settled();
  const map = document.querySelector('.view canvas'), chart = document.querySelector('.uplot'), sections = document.querySelectorAll('section.section').length;
  map.focus();
  for (let i = 0; i < 5; ++i) map.dispatchEvent(new KeyboardEvent('keydown', { key: 'ArrowLeft' }));
  show(live);  // draws at once
  const before = picture();
  show(live);
  const kept = before === picture() && document.activeElement === map && chart.isConnected;
  show(() => {});
  await settled();
  const more = document.querySelectorAll('section.section').length - sections;
  const ids = [...document.querySelectorAll('section.section')].map((s) => s.id).join(',');
  const ended = chart.isConnected && document.activeElement === map;
  const keypoints = new Set(), images = document.querySelectorAll('.live-camera canvas');
  for (const image of images) {
    const pixels = image.getContext('2d').getImageData(0, 0, image.width, image.height).data;
    for (let i = 0; i < pixels.length; i += 4) if (Math.max(pixels[i], pixels[i + 1], pixels[i + 2]) - Math.min(pixels[i], pixels[i + 1], pixels[i + 2]) > 60) keypoints.add(i);
  }
  document.title = `probe images=${images.length} coloured=${keypoints.size} kept=${kept} more=${more} ended=${ended} ids=${ids}`;
}, 1500);</script>'''


def run(*command):
    subprocess.run([str(word) for word in command], check=True, stdout=subprocess.DEVNULL)


def browse(browser, page, width, dark, screenshot):
    """Returns the messages of errors, and the title of the page. The screenshot, which starts the browser again, may be None."""
    command = [browser, *FLAGS, f'--window-size={width},1600', *(['--force-dark-mode'] if dark else [])]
    shown = subprocess.run([*command, '--dump-dom', page.as_uri()], capture_output=True, text=True, timeout=180)
    if screenshot:
        subprocess.run([*command, f'--screenshot={screenshot}', page.as_uri()], capture_output=True, timeout=180)
    errors = [line for line in shown.stderr.splitlines() if 'CONSOLE' in line and ('Uncaught' in line or 'Error' in line or 'ERROR' in line)]
    title = re.search(r'<title>(.*?)</title>', shown.stdout)
    return errors, title[1] if title else ''


def live_page(bslam, folder):
    """The page of a live view of a run that waits after some frames. It is opened as a file, so that it has no connection."""
    view = View(bslam, folder / 'data', folder / 'viewed', '--pace', 'realtime')
    try:
        connection = Browser(view)
        connection.send('pause')
        for _ in range(8):
            connection.send('step')
        while connection.next('frame')['index'] < 7:
            pass
        return view.request()[1]
    finally:
        view.process.kill()
        view.process.communicate()


def check_live(bslam, browser, folder, screenshots):
    text = (folder / 'run' / 'report.html').read_text()
    report = text.split('id="bslam-data">', 1)[1].split('</script>', 1)[0]
    page = folder / 'live.html'
    # In a file there is no host to connect to.
    page.write_text(live_page(bslam, folder).replace('<script>', '<script>window.WebSocket = class { send() {} };</script><script>', 1)
                    .replace('</body>', LIVE_PROBE.replace('REPORT', report) + '</body>'))
    errors, title = browse(browser, page, 1400, False, screenshots and folder / 'live.png')
    found = dict(item.split('=') for item in title.split()[1:] if '=' in item)
    cameras = len(json.loads(report)['rig'])
    fine = (not errors and found.get('images') == str(cameras) and int(found.get('coloured', 0)) > 100 and found.get('kept') == 'true'
            and found.get('ended') == 'true' and found.get('more') == '3'  # ground truth, residuals and calibration
            and found.get('ids') == 'map,plan,truth,timeline,cameras,residuals,calibration,time,events,settings')
    print(f'live: {"fine" if fine else "wrong"}: {title} {errors}')
    return not fine


def check(bslam, browser, folder, screenshots=False):
    run(bslam, 'simulate', '--out', folder / 'data', '--rig', RIG, '--duration', 2, '--rate', 10, '--progress', 'never', '--overwrite')
    run(bslam, 'run', folder / 'data', '--out', folder / 'run', '--mode', 'sequential', '--progress', 'never', '--overwrite')
    page = folder / 'page.html'
    page.write_text((folder / 'run' / 'report.html').read_text().replace('</body>', PROBE + '</body>'))
    failed = False
    for width, dark in ((1400, False), (1400, True), (500, False)):
        errors, title = browse(browser, page, width, dark, screenshots and folder / f'report_{width}_{"dark" if dark else "light"}.png')
        found = dict(item.split('=') for item in title.split()[1:] if '=' in item)
        fine = not errors and int(found.get('charts', 0)) >= 5 and int(found.get('colours', 0)) >= 20 and found.get('wide') == 'false'
        print(f'{width} px, {"dark" if dark else "light"}: {"fine" if fine else "wrong"}: {title} {errors}')
        failed |= not fine
    failed |= check_live(bslam, browser, folder, screenshots)
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
        return check(arguments.bslam, browser, arguments.keep.resolve(), screenshots=True)
    with tempfile.TemporaryDirectory() as folder:
        return check(arguments.bslam, browser, pathlib.Path(folder))


if __name__ == '__main__':
    sys.exit(main())

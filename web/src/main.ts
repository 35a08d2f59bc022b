// Shows the data in the page, if there are any. Other code of the page can pass data to `bslam.show`.
import { parseData, parseRun, Run } from './data';
import { LiveView } from './live';
import { LiveStart } from './live_data';
import { Page } from './page';
import { startThemes } from './theme';

declare global {
  interface Window { bslam: { show: (run: Run) => void; parse: (json: string) => Run | null } }
}

function start() {
  const root = document.getElementById('page')!;
  const data = parseData(document.getElementById('bslam-data')!.textContent!) as LiveStart | Run | null;
  if (data && 'live' in data && typeof data.live === 'object') {
    const view = new LiveView(root, data as LiveStart);
    window.bslam = { show: (run) => view.page.show(run), parse: parseRun };
    return;
  }
  const page = new Page(root);
  window.bslam = { show: (run) => page.show(run), parse: parseRun };
  if (data) page.show(data as Run);
}

startThemes();
start();

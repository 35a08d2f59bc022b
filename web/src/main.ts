// Shows the data in the page, if there are any. Other code of the page can pass data to `bslam.show`.
import { parseRun, Run } from './data';
import { Page } from './page';
import { startThemes } from './theme';

declare global {
  interface Window { bslam: { show: (run: Run) => void; parse: (json: string) => Run | null } }
}

startThemes();
const page = new Page(document.getElementById('page')!);
window.bslam = { show: (run) => page.show(run), parse: parseRun };
const run = parseRun(document.getElementById('bslam-data')!.textContent!);
if (run) page.show(run);

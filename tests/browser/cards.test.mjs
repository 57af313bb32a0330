// From a fault to its card: each test kills a process, or aborts an NC program, and waits for the right card on an open
// page. It prints how long that took, and fails only if the card does not come, or differs on a page that is loaded again.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { awaitText, Browser, textOf } from './browser.mjs';
import { Plant, slowUuid, until } from './plant.mjs';

let browser;

before(async () => {
  browser = await Browser.start();
});

after(async () => {
  await browser?.stop();
});

const running = '[data-channel="cnc/1"][data-state="running"]';

/** A call that runs on the only instance of its service. */
async function callOf(plant, flags) {
  await plant.cnc();
  await plant.gateway();
  const service = await plant.slowService({ flags });
  await plant.request(1, slowUuid, 'part 4711');
  return () => service.stop('SIGKILL');
}

// What happens, the kind of its card, a part of the card that makes it the right one, what the page shows before, and the
// preparation, which resolves with what causes the fault.
const faults = [
  ['a gateway is killed', 'gateway gone', /The gateway on \S+, pid \d+, does not respond/, '[data-channel="cnc/1"][data-state="idle"]', async (plant) => {
    await plant.cnc();
    const gateway = await plant.gateway();
    return () => gateway.stop('SIGKILL');
  }],
  ['the only instance is killed', 'unserved', /last (instance|one)/, running, (plant) => callOf(plant, ['--delivery', 'at-least-once'])],
  ['an at-most-once instance is killed during its call', 'held', /exited during this call, which may run only once/, running, (plant) => callOf(plant, [])],
  ['a controller is killed', 'link down', /cnc/, '[data-channel="cnc/1"][data-state="idle"]', async (plant) => {
    const cnc = await plant.cnc();
    await plant.gateway();
    return () => cnc.stop('SIGKILL');
  }],
  ['an NC program is aborted', 'program aborted', /bad/, '[data-channel="cnc/1"][data-state="idle"]', async (plant) => {
    plant.file('bad.nc', '%bad\n#FLUSH WAIT\nP1 = 1 / 0\nM30\n');
    await plant.cnc();
    await plant.configuredGateway('programs { name: "mc_program_name_r" error: "mc_error_id_r" }');
    return () => plant.runProgram('bad.nc');
  }],
];

const parts = ['name', 'subject', 'since', 'why', 'advice'];
/** Without times of day: each page measures its clock against that of the server, and a second may begin in between. */
const cardOf = (page, kind) => page.$$eval(`.concern[data-kind="${kind}"]`, (cards, wanted) => cards.map((card) => wanted.map((part) => card.querySelector(`.concern-${part}`).textContent.replace(/\d\d:\d\d:\d\d/g, 'TIME'))), parts);

for (const [what, kind, right, ready, prepare] of faults) {
  test(`${what}: its card comes, and is the same on a page that is loaded again`, async (context) => {
    const plant = await Plant.start();
    try {
      const web = await plant.web();
      const cause = await prepare(plant);
      const page = await browser.open(web.url, { view: '#/plant' });
      const other = await browser.open(web.url, { view: '#/plant' });
      await Promise.all([page.waitForSelector(ready), other.waitForSelector(ready)]);
      assert.equal(await textOf(page, '.concern'), undefined);
      const began = performance.now();
      const caused = cause();
      await awaitText(page, `.concern[data-kind="${kind}"]`, right);
      context.diagnostic(`${what}: card after ${Math.round(performance.now() - began)} ms`);
      if (kind === 'held') {
        assert.match(await textOf(page, '.at-terminal'), new RegExp(`millrace retry cnc/1 --domain ${plant.domain}\\b`));
      }
      await caused;
      await other.reload();
      let cards = [];
      await until(async () => {
        cards = [await cardOf(page, kind), await cardOf(other, kind)];
        return cards[0].length === 1 && JSON.stringify(cards[0]) === JSON.stringify(cards[1]);
      }, 'the same card on both pages').catch((error) => {
        throw new Error(`${error.message}: ${JSON.stringify(cards)}`);
      });
      assert.equal((await page.$$('.concern')).length, 1, 'one card for one cause');
      await page.close();
      await other.close();
    } finally {
      await plant.stop();
    }
  });
}

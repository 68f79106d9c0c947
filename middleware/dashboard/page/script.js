'use strict';
const $ = (id) => document.getElementById(id);
const token = document.querySelector('meta[name=nido-token]').content;
const degrees = 180 / Math.PI;
// everything shown is set as text, never as HTML: names and sentences come from any process
const make = (tag, text, name) => {
  const element = document.createElement(tag);
  if (text !== undefined) element.textContent = text;
  if (name) element.className = name;
  return element;
};
const seconds = (s) => s == null ? '–' : s.toFixed(2) + ' s';

// ---- orders
async function order(path, body) {
  try {
    const reply = await fetch(path, {method: 'POST', body: JSON.stringify(body || {}),
      headers: {'Content-Type': 'application/json', 'X-Nido-Token': token}});
    return await reply.json();
  } catch (error) {
    return {error: 'no answer: is the run still there?'};
  }
}
function answer(question, reply) {
  const item = make('li');
  item.append(make('span', question, 'soft'), '\n', make('span', reply.error || reply.answer || '(empty)', reply.error ? 'bad' : ''));
  $('answers').prepend(item);
  while ($('answers').children.length > 50) $('answers').lastChild.remove();
}
function form(id, input, act) {
  const past = [];
  let place = 0;
  $(id).addEventListener('submit', async (event) => {
    event.preventDefault();
    const text = $(input).value.trim();
    if (!text) return;
    past.push(text);
    place = past.length;
    $(input).value = '';
    await act(text);
  });
  // older lines, as in a shell
  $(input).addEventListener('keydown', (event) => {
    const step = {ArrowUp: -1, ArrowDown: 1}[event.key];
    if (!step || !past.length) return;
    event.preventDefault();
    place = Math.min(Math.max(place + step, 0), past.length);
    $(input).value = past[place] || '';
  });
}
form('say-form', 'say', async (text) => answer('say ' + text, await order('/say', {text})));
form('ask-form', 'ask', async (text) => {
  const port = $('service').value;
  answer(port + ' ' + text, await order('/ask', {port, text}));
});
$('stop').addEventListener('click', async () => {
  const button = $('stop');
  // asked twice, so that a slip of the hand does not end an hour's run
  if (button.dataset.sure !== 'yes') {
    button.dataset.sure = 'yes';
    button.textContent = 'Really stop?';
    setTimeout(() => { button.dataset.sure = ''; button.textContent = 'Stop the run'; }, 3000);
    return;
  }
  button.disabled = true;
  answer('stop', await order('/stop'));
});

// ---- the run, its processes
let run = null;
function notice(text, kind) {
  $('notice').hidden = !text;
  $('notice').textContent = text || '';
  $('notice').className = kind || '';
}
function showState(state) {
  run = state.run && state.run.app ? state.run : null;
  const present = run && run.here;
  $('app').textContent = run ? run.app : 'nido';
  document.title = run ? run.app + ' · nido' : 'nido';
  $('summary').textContent = run
    ? `robot ${run.robot}, world ${run.world}, seed ${run.seed}, rate ${run.rate}${run.lockstep ? ' in lockstep' : ''}; writes ${run.out}`
    : `domain ${state.domain}, not started by nido launch`;
  const word = run ? (run.state === 'ended' ? (run.exit_code === 0 ? 'success' : run.exit_code === 130 ? 'stopped' : 'failed') : run.state) : 'running';
  pill(word);
  $('wall').textContent = run ? run.wall_s.toFixed(0) + ' s' : '–';
  $('stop').disabled = !present || run.state === 'ended';
  if (run && run.state === 'ended') notice(run.sentence, run.exit_code === 0 ? 'good' : run.exit_code === 130 ? 'warn' : 'bad');
  showProcesses(state);
  showServices(state.services);
  showCameras(state.cameras);
}
function pill(word) {
  $('run-state').textContent = word;
  $('run-state').className = 'pill ' + ({running: 'good', success: 'good', failed: 'bad', stopped: 'warn'}[word] || '');
}
const stateKind = {ready: 'good', failed: 'bad', gone: 'bad', restarting: 'warn', starting: 'warn'};
function showProcesses(state) {
  const rows = new Map(state.nodes.map((node) => [node.name, node]));
  if (run) for (const process of run.processes) {
    const node = rows.get(process.name) || {name: process.name, pid: process.pid, cpu: 0, memory_mb: 0, detail: ''};
    // what the process says of itself counts, unless it is not there to say it
    const says = node.state && node.state !== 'gone' ? node.state : process.state === 'ready' ? 'ready' : process.state;
    rows.set(process.name, {...node, state: says, restarts: process.restarts, detail: node.detail || process.reason});
  }
  const body = $('processes').tBodies[0];
  body.replaceChildren(...[...rows.values()].map((row) => {
    const line = make('tr');
    const stateCell = make('td', row.state, stateKind[row.state] || 'soft');
    if (row.detail) stateCell.append(make('span', row.detail, 'why'));
    line.append(make('td', row.name), stateCell, make('td', row.restarts || 0, 'n' + (row.restarts ? ' warn' : '')),
      make('td', (100 * row.cpu).toFixed(0) + ' %', 'n'), make('td', row.memory_mb.toFixed(0) + ' MB', 'n'),
      make('td', row.pid > 0 ? row.pid : '', 'n soft'));
    return line;
  }));
}
let services = '';
let chosen = '';
$('service').addEventListener('change', () => { chosen = $('service').value; });
function showServices(names) {
  if (names.join() === services) return;
  services = names.join();
  $('service').replaceChildren(...names.map((name) => make('option', name)));
  // what was chosen, or what most people want
  const wish = names.includes(chosen) ? chosen : names.find((name) => name.endsWith('/world'));
  if (wish) $('service').value = wish;
}
function showTime(time) {
  $('sim').textContent = seconds(time.simulated_s);
  $('rate').textContent = time.rate == null ? '–' : time.rate.toFixed(2) + ' ×';
}

// ---- cameras: one picture is asked for after another, only while it can be seen
const cameras = new Map();
const seen = new IntersectionObserver((entries) => entries.forEach((entry) => {
  const camera = cameras.get(entry.target.dataset.port);
  if (camera) camera.visible = entry.isIntersecting;
}));
const rank = (port) => port.includes('/outside/') ? 0 : port.includes('/left/') ? 1 : port.includes('/right/') ? 2 : 3;
const caption = (port) => {
  const match = port.match(/cam\/(\w+)/);
  return match ? {left: 'left eye', right: 'right eye', outside: 'from outside'}[match[1]] || match[1] : port;
};
function showCameras(ports) {
  for (const camera of cameras.values()) camera.there = ports.includes(camera.port);
  const there = ports.filter((port) => cameras.has(port)).length;
  if (there === ports.length && cameras.size === ports.length) return;
  for (const port of ports) if (!cameras.has(port)) {
    const figure = make('figure');
    const image = make('img');
    image.alt = caption(port);
    figure.dataset.port = port;
    figure.append(image, make('figcaption', caption(port)));
    const camera = {figure, image, visible: false, there: true, number: 0, port};
    cameras.set(port, camera);
    seen.observe(figure);
    watch(camera);
  }
  const all = [...cameras.values()].sort((a, b) => rank(a.port) - rank(b.port) || a.port.localeCompare(b.port));
  if (all.length) $('cameras').replaceChildren(...all.map((camera) => camera.figure));
}
const pause = (ms) => new Promise((done) => setTimeout(done, ms));
async function watch(camera) {
  for (;;) {
    if (!camera.visible || !camera.there || document.hidden || !connected) { await pause(300); continue; }
    try {
      const reply = await fetch(`/camera?port=${encodeURIComponent(camera.port)}&after=${camera.number}`);
      if (reply.status === 200) {
        camera.number = +reply.headers.get('X-Picture');
        const address = URL.createObjectURL(await reply.blob());
        camera.image.src = address;
        await camera.image.decode().catch(() => {});
        URL.revokeObjectURL(address);
        // fifteen a second are enough for people
        await pause(66);
      } else await pause(reply.status === 204 ? 50 : 2000);
    } catch (error) {
      await pause(1000);
    }
  }
}

// ---- story
let storyEmpty = true;
function addStory(events) {
  const list = $('story');
  const atEnd = list.scrollTop + list.clientHeight >= list.scrollHeight - 30;
  for (const event of events) {
    if (storyEmpty) { list.replaceChildren(); storyEmpty = false; }
    const item = make('li');
    item.append(make('time', event.t.toFixed(2) + ' s'), make('span', event.stage, 'stage'),
      make('span', event.text || event.state + ' ' + event.object, {done: 'good', failed: 'bad'}[event.state] || ''));
    list.append(item);
  }
  while (list.children.length > 500) list.firstChild.remove();
  if (atEnd) list.scrollTop = list.scrollHeight;
}

// ---- joints and touch
let body = {};
const bars = new Map();
function showBody(parts) {
  body = parts;
  bars.clear();
  const order = ['head', 'torso', 'left_arm', 'right_arm', 'left_leg', 'right_leg'];
  const place = (port) => order.findIndex((part) => port.includes(`/${part}/`));
  const blocks = Object.keys(parts).sort((a, b) => place(a) - place(b) || a.localeCompare(b)).map((port) => {
    const block = make('div');
    block.append(make('h3', port.replace(/^\/[^/]*\//, '').replace('/state:o', '').replace('_', ' ')));
    bars.set(port, parts[port].map((joint) => {
      const row = make('div', undefined, 'joint');
      const track = make('div', undefined, 'track');
      const mark = make('i');
      const value = make('span', '', 'n');
      track.title = `${(joint.min * degrees).toFixed(0)}° to ${(joint.max * degrees).toFixed(0)}°`;
      track.append(mark);
      row.append(make('span', joint.name), track, value);
      row.firstChild.title = joint.name;
      block.append(row);
      return {mark, value, joint};
    }));
    return block;
  });
  if (blocks.length) $('joints').replaceChildren(...blocks);
}
function showJoints(parts) {
  for (const [port, angles] of Object.entries(parts)) (bars.get(port) || []).forEach(({mark, value, joint}, i) => {
    const angle = angles[i];
    if (angle === undefined) return;
    const part = Math.min(Math.max((angle - joint.min) / (joint.max - joint.min), 0), 1);
    mark.style.left = 100 * part + '%';
    mark.className = part < 0.02 || part > 0.98 ? 'edge' : '';
    value.textContent = (angle * degrees).toFixed(1).replace(/^-0\.0$/, '0.0');
  });
}
const padNames = ['thumb', 'index', 'middle', 'ring', 'little', 'palm'];
const pads = new Map();
function showTouch(hands) {
  for (const [port, hand] of Object.entries(hands)) {
    let cells = pads.get(port);
    if (!cells) {
      const match = port.match(/(\w+)_hand/);
      const name = match ? match[1] + ' hand' : port.replace(/^.*\/skin\//, '').replace(':o', '').replace('_', ' ');
      cells = hand.on.map((_, i) => {
        const cell = make('div', hand.on.length === 1 ? 'all' : padNames[i] || i, 'pad');
        cell.append(make('b', '–'));
        return cell;
      });
      const grid = make('div', undefined, 'pads');
      grid.append(...cells);
      if (!pads.size) $('touch').replaceChildren();
      $('touch').append(make('h3', name), grid);
      pads.set(port, cells);
    }
    hand.on.forEach((on, i) => {
      if (!cells[i]) return;
      cells[i].classList.toggle('on', on);
      cells[i].lastChild.textContent = (hand.force_n[i] || 0).toFixed(1);
    });
  }
}

// ---- ports
// each name once, with how often it comes
function list(names) {
  const count = new Map();
  for (const name of names) count.set(name, (count.get(name) || 0) + 1);
  return [...count].map(([name, times]) => times > 1 ? `${name} (${times} times)` : name).join(', ');
}
let ports = [];
function showPorts() {
  const words = $('port-filter').value.toLowerCase().split(/\s+/).filter(Boolean);
  const chosen = ports.filter((port) => {
    const text = `${port.name} ${port.type} ${port.node}`.toLowerCase();
    return words.every((word) => text.includes(word));
  }).sort((a, b) => a.name.localeCompare(b.name));
  $('port-count').textContent = words.length ? `${chosen.length} of ${ports.length}` : ports.length;
  const number = (value, digits) => value === undefined ? '' : value.toFixed(digits);
  $('ports').tBodies[0].replaceChildren(...chosen.map((port) => {
    const lost = port.connections.reduce((sum, one) => sum + (one.lost || 0), 0);
    const line = make('tr');
    line.append(make('td', port.name), make('td', port.type, 'wrap'), make('td', port.node),
      make('td', number(port.hz, port.hz < 10 ? 1 : 0), 'n'), make('td', port.bytes_s === undefined ? '' : (port.bytes_s / 1000).toFixed(0), 'n'),
      make('td', (port.direction === 'input' && port.connections.length ? '← ' : port.connections.length ? '→ ' : '') +
        list(port.connections.map((one) => one.name + (one.live === false ? ' (not there)' : ''))), 'wrap'),
      make('td', lost || '', 'n' + (lost ? ' warn' : '')));
    return line;
  }));
}
$('port-filter').addEventListener('input', showPorts);

// ---- log
const levels = ['debug', 'info', 'warning', 'error'];
let log = [];
function logItem(line) {
  const item = make('li');
  // of the robot's time, or of the computer's clock
  const when = line.t < 1e9 ? line.t.toFixed(2) : new Date(line.t * 1000).toTimeString().slice(0, 8);
  item.append(make('time', when), make('span', line.node, 'node'),
    make('span', line.text, 'text ' + ({warning: 'warn', error: 'bad', debug: 'soft'}[line.level] || '')));
  return item;
}
function wanted(line) {
  const words = $('log-filter').value.toLowerCase().split(/\s+/).filter(Boolean);
  const text = `${line.node} ${line.text}`.toLowerCase();
  return levels.indexOf(line.level) >= +$('log-level').value && words.every((word) => text.includes(word));
}
function addLog(lines) {
  log = log.concat(lines).slice(-2000);
  $('log').append(...lines.filter(wanted).map(logItem));
  while ($('log').children.length > 2000) $('log').firstChild.remove();
  followLog();
}
function showLog() {
  $('log').replaceChildren(...log.filter(wanted).map(logItem));
  followLog();
}
function followLog() { if ($('log-follow').checked) $('log').scrollTop = $('log').scrollHeight; }
for (const id of ['log-filter', 'log-level', 'log-follow']) $(id).addEventListener('input', showLog);

// ---- live data
let connected = false;
let finished = false;
const source = new EventSource('/events');
source.onopen = () => { connected = true; finished = false; notice(''); };
source.onerror = () => {
  connected = false;
  $('stop').disabled = true;
  if (finished) return;
  pill(run && run.state === 'ended' ? $('run-state').textContent : 'no contact');
  if (!run || run.state !== 'ended') notice('No contact with the dashboard. What is shown is what was last seen.', 'warn');
};
const on = (name, act) => source.addEventListener(name, (event) => act(JSON.parse(event.data)));
on('state', showState);
on('time', showTime);
on('ports', (list) => { ports = list; showPorts(); });
on('body', showBody);
on('joints', showJoints);
on('touch', showTouch);
on('story', addStory);
on('whole_story', (events) => { $('story').replaceChildren(make('li', 'Nothing has been told yet.', 'empty')); storyEmpty = true; addStory(events); });
on('log', addLog);
on('whole_log', (lines) => { log = lines; showLog(); });
on('bye', () => {
  finished = true;
  if (!run || run.state !== 'ended') { pill('ended'); notice('The dashboard has ended with its run.', 'warn'); }
});

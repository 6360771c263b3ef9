// What a page does: draws its figures when they come into view, and gives their numbers away.
const read = id => JSON.parse(document.getElementById(id).textContent);
const bytesOf = text => {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
  const letters = atob(text), bytes = new Uint8Array(letters.length);
  for (let i = 0; i < bytes.length; i++) bytes[i] = letters.charCodeAt(i);
  return bytes;
};
const unpacked = values => Array.isArray(values) ? values
  : values.f4 !== undefined ? new Float32Array(bytesOf(values.f4).buffer) : new Float64Array(bytesOf(values.f8).buffer);

const libraryReady = (async () => {
  const packed = document.getElementById('library');
  const stream = new Blob([bytesOf(packed.textContent)]).stream().pipeThrough(new DecompressionStream('gzip'));
  const script = document.createElement('script');
  script.textContent = await new Response(stream).text();
  document.head.append(script);
  packed.remove();
})();

const template = read('template');
const drawn = new Map();  // element -> promise
const draw = place => {
  if (!drawn.has(place)) drawn.set(place, libraryReady.then(() => {
    const number = place.id.slice(1), drawing = read('drawing' + number), data = read('data' + number);
    const columns = {};
    drawing.layout.template = template;
    data.sources.forEach(([x, y], k) => {
      for (const name of [x, y]) columns[name] = columns[name] ?? unpacked(data.columns[name]);
      drawing.data[k].x = columns[x];
      drawing.data[k].y = columns[y];
    });
    return Plotly.newPlot(place, drawing.data, drawing.layout, {responsive: true, displaylogo: false});
  }).then(() => { place.dataset.drawn = 'yes'; shareTime(place); }));
  return drawn.get(place);
};
const places = [...document.querySelectorAll('.drawing')];
const watcher = new IntersectionObserver(seen => seen.filter(one => one.isIntersecting).forEach(one => {
  watcher.unobserve(one.target);
  draw(one.target);
}), {rootMargin: '400px'});
places.forEach(place => watcher.observe(place));
window.drawAll = () => Promise.all(places.map(draw));
window.addEventListener('beforeprint', window.drawAll);

// Figures over time show the same stretch of it.
let sharing = false;
const shareTime = place => {
  if (!place.layout.meta || place.layout.meta !== 'time') return;
  place.on('plotly_relayout', async change => {
    const range = change['xaxis.range[0]'] !== undefined ? [change['xaxis.range[0]'], change['xaxis.range[1]']]
      : change['xaxis.autorange'] ? null : undefined;
    if (sharing || range === undefined) return;
    sharing = true;
    const update = range ? {'xaxis.range': range} : {'xaxis.autorange': true};
    for (const other of places)
      if (other !== place && other.dataset.drawn && other.layout.meta === 'time') await Plotly.relayout(other, update);
    sharing = false;
  });
};

const quoted = text => /[",\n]/.test(text) ? '"' + text.replace(/"/g, '""') + '"' : text;
const cell = value => value === null || value === undefined || Number.isNaN(value) ? '' : quoted(String(value));
const table = columns => Object.fromEntries(Object.entries(columns).map(([name, values]) => [name,
  values.f4 === undefined ? [...unpacked(values)] : Array.from(unpacked(values), value => Number(value.toPrecision(7)))]));
const csv = columns => {
  const all = table(columns), names = Object.keys(all), rows = [names.map(cell).join(',')];
  const length = Math.max(...names.map(name => all[name].length));
  for (let i = 0; i < length; i++) rows.push(names.map(name => cell(all[name][i])).join(','));
  return rows.join('\n') + '\n';
};
window.tableOf = number => csv(read('data' + number).columns);
for (const button of document.querySelectorAll('button[data-of]')) button.addEventListener('click', () => {
  const data = read('data' + button.dataset.of), kind = button.dataset.as;
  const text = kind === 'csv' ? csv(data.columns)
    : JSON.stringify({title: data.title, columns: table(data.columns)}, (_, value) => Number.isNaN(value) ? null : value, 1);
  const link = document.createElement('a');
  link.href = URL.createObjectURL(new Blob([text], {type: kind === 'csv' ? 'text/csv' : 'application/json'}));
  link.download = data.title.replace(/[^A-Za-z0-9_-]+/g, '_') + '.' + kind;
  link.click();
  URL.revokeObjectURL(link.href);
});

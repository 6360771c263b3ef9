// Pictures in space: meshes that stand in frames, whose poses over time are known; a slider and a button move the time.
const turned = (pose, at, x, y, z) => {
  const [px, py, pz, qx, qy, qz, qw] = pose.subarray(7 * at, 7 * at + 7);
  const ux = 2 * (qy * z - qz * y), uy = 2 * (qz * x - qx * z), uz = 2 * (qx * y - qy * x);
  return [px + x + qw * ux + qy * uz - qz * uy, py + y + qw * uy + qz * ux - qx * uz, pz + z + qw * uz + qx * uy - qy * ux];
};

const openSpace = async place => {
  const data = read('space' + place.id.slice(1)), t = unpacked(data.t);
  const frames = data.frames.map(unpacked);  // of each the seven numbers of its pose in the root, time after time
  const figure = place.closest('figure'), slider = figure.querySelector('input'), told = figure.querySelector('output');
  const meshes = data.meshes.map(mesh => ({...mesh, parts: mesh.parts.map(part => ({...part,
    vertices: unpacked(part.vertices)}))}));
  const arrows = data.arrows.map(arrow => ({...arrow, points: unpacked(arrow.points)}));
  const corners = (mesh, at) => {
    const x = [], y = [], z = [];
    for (const part of mesh.parts) for (let k = 0; k < part.vertices.length; k += 3) {
      const found = turned(frames[part.frame], part.moves ? at : 0, part.vertices[k], part.vertices[k + 1], part.vertices[k + 2]);
      x.push(found[0]); y.push(found[1]); z.push(found[2]);
    }
    return {x, y, z};
  };
  const ends = (arrow, at) => {
    const p = arrow.points.subarray(6 * at, 6 * at + 6);
    return {x: [p[0], p[3]], y: [p[1], p[4]], z: [p[2], p[5]]};
  };
  const trail = one => {
    const points = unpacked(one.points), axis = k => Array.from(points).filter((_, i) => i % 3 === k);
    return {type: 'scatter3d', mode: 'lines', name: one.name, x: axis(0), y: axis(1), z: axis(2), hoverinfo: 'skip',
      line: {color: one.colour, width: 3}};
  };
  const traces = [
    ...meshes.map(mesh => ({type: 'mesh3d', name: mesh.name, ...corners(mesh, 0), i: mesh.i, j: mesh.j, k: mesh.k,
      ...(mesh.colour ? {color: mesh.colour} : {facecolor: mesh.colours}), opacity: mesh.opacity, flatshading: true, hoverinfo: 'name', showlegend: false,
      lighting: {ambient: 0.6, diffuse: 0.7, specular: 0.1}})),
    ...arrows.map(arrow => ({type: 'scatter3d', mode: 'lines+markers', name: arrow.name, ...ends(arrow, 0),
      line: {color: arrow.colour, width: 7}, marker: {size: [0, 4], color: arrow.colour}, hoverinfo: 'name'})),
    ...data.trails.map(trail)];
  const moving = traces.map((_, k) => k).filter(k => k < meshes.length ? meshes[k].moves : k < meshes.length + arrows.length);
  const axis = (range, title) => ({range, title, showspikes: false, backgroundcolor: '#fbfcfc'});
  const box = data.box, names = data.axes;
  await libraryReady;
  await Plotly.newPlot(place, traces, {margin: {l: 0, r: 0, t: 0, b: 0}, legend: {x: 0, y: 1}, uirevision: 'kept',
    scene: {aspectmode: 'cube', xaxis: axis(box[0], names[0]), yaxis: axis(box[1], names[1]), zaxis: axis(box[2], names[2]),
      camera: {eye: {x: 0.8, y: -0.9, z: 0.55}}}}, {responsive: true, displaylogo: false});
  const show = at => {
    const found = moving.map(k => k < meshes.length ? corners(meshes[k], at) : ends(arrows[k - meshes.length], at));
    told.textContent = `t = ${t[at].toFixed(2)} s`;
    place.dataset.time = t[at];
    const update = {x: found.map(one => one.x), y: found.map(one => one.y), z: found.map(one => one.z)};
    const follow = figure.querySelector('.follow');
    if (!follow || !follow.checked) return Plotly.restyle(place, update, moving);
    const middle = turned(frames[data.base], at, 0, 0, 0), layout = {};
    ['x', 'y', 'z'].forEach((name, k) => {
      layout[`scene.${name}axis.range`] = [middle[k] - data.extent, middle[k] + data.extent];
    });
    return Plotly.update(place, update, layout, moving);
  };
  const index = time => {
    let low = 0, high = t.length - 1;
    while (low < high) { const middle = (low + high + 1) >> 1; if (t[middle] <= time) low = middle; else high = middle - 1; }
    return low;
  };
  slider.min = t[0]; slider.max = t[t.length - 1]; slider.value = t[0];
  let wanted = null, busy = false;
  const ask = async () => {
    wanted = index(Number(slider.value));
    if (busy) return;
    busy = true;
    while (wanted !== null) { const at = wanted; wanted = null; await show(at); }
    busy = false;
  };
  slider.addEventListener('input', ask);
  const follow = figure.querySelector('.follow');
  if (follow) follow.addEventListener('change', () => follow.checked ? ask() : Plotly.relayout(place, Object.fromEntries(
    ['x', 'y', 'z'].map((name, k) => [`scene.${name}axis.range`, box[k]]))));
  let since = null;
  const button = figure.querySelector('.play');
  const step = async now => {
    if (since === null) return;
    const speed = (t[t.length - 1] - t[0]) / Math.max(10, Math.min(60, t[t.length - 1] - t[0]));
    const next = since.time + speed * (now - since.wall) / 1000;
    slider.value = next;
    await ask();
    if (next >= t[t.length - 1]) { since = null; button.textContent = 'Play'; } else requestAnimationFrame(step);
  };
  button.addEventListener('click', () => {
    if (since !== null) { since = null; button.textContent = 'Play'; return; }
    const from = Number(slider.value) >= t[t.length - 1] ? t[0] : Number(slider.value);
    since = {time: from, wall: performance.now()};
    button.textContent = 'Pause';
    requestAnimationFrame(step);
  });
  await show(0);
  place.dataset.drawn = 'yes';
};
const spaces = [...document.querySelectorAll('.space')];
const opened = new Map();
window.openSpaces = () => Promise.all(spaces.map(place => {
  if (!opened.has(place)) opened.set(place, openSpace(place).catch(error => {
    place.textContent = 'The picture in space needs WebGL, which this browser does not give: ' + error.message;
  }));
  return opened.get(place);
}));
const spaceWatcher = new IntersectionObserver(seen => {
  if (seen.some(one => one.isIntersecting)) { spaceWatcher.disconnect(); window.openSpaces(); }
}, {rootMargin: '200px'});
spaces.forEach(place => spaceWatcher.observe(place));

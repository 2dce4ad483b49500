// The interactive view: unpacks the scene, draws it with WebGL 2, turns it by pointer, touch and keys.
"use strict";
(() => {
  const element = (id) => document.getElementById(id);
  const canvas = element("view");
  const gl = canvas.getContext("webgl2", { antialias: true, alpha: true, premultipliedAlpha: true });
  if (!gl) {
    element("viewer").hidden = true;
    element("no-view").hidden = false;
    return;
  }
  const scene = JSON.parse(element("scene").textContent);

  // ---- unpacking

  const bytesOf = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));

  function cornersOf(text) {
    const bytes = bytesOf(text);
    const corners = [];
    let before = 0;
    for (let at = 0; at < bytes.length; at++) {
      let value = 0;
      let unit = 1;
      for (; bytes[at] >= 128; at++, unit *= 128) value += (bytes[at] & 127) * unit;
      value += bytes[at] * unit;
      before += value % 2 ? -(value + 1) / 2 : value / 2;
      corners.push(before);
    }
    return new Uint32Array(corners);
  }

  function pointsOf(text) {
    const view = new DataView(bytesOf(text).buffer);
    const points = new Float32Array(view.byteLength / 2);
    for (let i = 0; i < points.length; i++) points[i] = view.getUint16(2 * i, true) * scene.step + scene.low[i % 3];
    return points;
  }

  function normalsOf(points, corners) {
    const normals = new Float32Array(points.length);
    const at = (v, k) => points[3 * v + k];
    for (let t = 0; t < corners.length; t += 3) {
      const [a, b, c] = [corners[t], corners[t + 1], corners[t + 2]];
      const u = [0, 1, 2].map((k) => at(b, k) - at(a, k));
      const v = [0, 1, 2].map((k) => at(c, k) - at(a, k));
      const n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
      for (const w of [a, b, c]) for (let k = 0; k < 3; k++) normals[3 * w + k] += n[k];
    }
    return normals;
  }

  // ---- drawing

  const VERTEX = `#version 300 es
    in vec3 point, normal; in float distance_, error_, label;
    uniform bool expected;
    uniform mat3 turn; uniform vec3 centre; uniform vec2 zoom; uniform float depth, dot_;
    out vec3 facing; out float far, measured;
    void main() {
      vec3 p = turn * (point - centre);
      float near = 1.0 - p.z * depth * 0.22;
      gl_Position = vec4(p.xy * zoom, -p.z * depth * 0.5 * near, near);
      gl_PointSize = dot_;
      facing = turn * normal;
      far = expected ? error_ * error_ : distance_ * distance_;
      measured = label;
    }`;
  const FRAGMENT = `#version 300 es
    precision highp float;
    in vec3 facing; in float far, measured;
    uniform int colouring; uniform float range; uniform vec3 stops[5], clay, inferred;
    out vec4 colour;
    vec3 scale(float x) {
      float at = clamp(x, 0.0, 1.0) * 4.0;
      int i = int(min(floor(at), 3.0));
      return mix(stops[i], stops[i + 1], at - float(i));
    }
    void main() {
      vec3 base = colouring == 2 ? scale(far / range) : colouring == 1 && measured < 0.5 ? inferred : clay;
      float size = length(facing);
      vec3 n = size > 0.0 ? facing / size : vec3(0.0, 0.0, 1.0);
      // The winding tells the back side from the front; clouds have neither.
      if (size > 0.0 && !gl_FrontFacing) { n = -n; base *= 0.45; }
      float light = 0.34 + 0.62 * max(dot(n, normalize(vec3(-0.45, 0.55, 0.7))), 0.0)
                  + 0.14 * max(dot(n, normalize(vec3(0.8, 0.0, 0.6))), 0.0);
      colour = vec4(min(base * light, 1.0), 1.0);
    }`;

  function program() {
    const made = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(made, shader);
    }
    gl.linkProgram(made);
    return made;
  }

  // A context can be lost when a phone puts the page aside: everything on the card is made again.
  let shader, places, uniforms;
  const uploaded = new Map();
  function setUp() {
    uploaded.clear();
    shader = program();
    places = Object.fromEntries(["point", "normal", "distance_", "error_", "label"].map((n) => [n, gl.getAttribLocation(shader, n)]));
    const names = ["turn", "centre", "zoom", "depth", "dot_", "colouring", "expected", "range", "stops", "clay", "inferred"];
    uniforms = Object.fromEntries(names.map((n) => [n, gl.getUniformLocation(shader, n)]));
    gl.enable(gl.DEPTH_TEST);
  }

  function upload(index) {
    if (uploaded.has(index)) return uploaded.get(index);
    const surface = scene.surfaces[index];
    const points = pointsOf(surface.points);
    const corners = cornersOf(surface.corners);
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    const attribute = (name, data, size, type, normalised) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(places[name]);
      gl.vertexAttribPointer(places[name], size, type, normalised, 0, 0);
    };
    attribute("point", points, 3, gl.FLOAT, false);
    attribute("normal", normalsOf(points, corners), 3, gl.FLOAT, false);
    attribute("distance_", bytesOf(surface.distances), 1, gl.UNSIGNED_BYTE, true);
    attribute("error_", bytesOf(surface.errors || surface.distances), 1, gl.UNSIGNED_BYTE, true);
    const labels = surface.labels ? bytesOf(surface.labels) : new Uint8Array(surface.vertices).fill(1);
    attribute("label", labels, 1, gl.UNSIGNED_BYTE, false);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, corners, gl.STATIC_DRAW);
    const made = { array, corners: corners.length, vertices: surface.vertices };
    uploaded.set(index, made);
    return made;
  }

  // All surfaces are seen from one place: the last one, the completed, says where.
  const frame = (() => {
    const points = pointsOf(scene.surfaces[scene.surfaces.length - 1].points);
    const low = [Infinity, Infinity, Infinity];
    const high = [-Infinity, -Infinity, -Infinity];
    for (let i = 0; i < points.length; i++) {
      low[i % 3] = Math.min(low[i % 3], points[i]);
      high[i % 3] = Math.max(high[i % 3], points[i]);
    }
    return { centre: low.map((l, k) => (l + high[k]) / 2), radius: Math.hypot(...low.map((l, k) => high[k] - l)) / 2 };
  })();

  const START = { yaw: -25, pitch: 8, zoom: 1 };
  const look = { ...START };
  // Only some surfaces have expected errors.
  const colouringOf = (surface) => (chosen("colouring") === 3 && !surface.errors ? 0 : chosen("colouring"));
  const chosen = (name) => Number(document.querySelector(`input[name=${name}]:checked`).value);

  function turn() {
    const [y, p] = [look.yaw, look.pitch].map((degrees) => (degrees * Math.PI) / 180);
    const [cy, sy, cp, sp] = [Math.cos(y), Math.sin(y), Math.cos(p), Math.sin(p)];
    const [right, up, front] = scene.axes;
    const rows = [[cy, 0, sy], [sp * sy, cp, -sp * cy], [-cp * sy, sp, cp * cy]];
    const entry = (row, k) => row[0] * right[k] + row[1] * up[k] + row[2] * front[k];
    return [0, 1, 2].flatMap((k) => rows.map((row) => entry(row, k)));
  }

  const hex = (text) => [1, 3, 5].map((i) => parseInt(text.slice(i, i + 2), 16) / 255);
  const STOPS = ["#440154", "#3b528b", "#21918c", "#5ec962", "#fde725"];

  let asked = false;
  const redraw = () => {
    if (!asked) requestAnimationFrame(draw);
    asked = true;
  };

  function draw() {
    asked = false;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((l) => Math.max(1, Math.round(l * ratio)));
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const surface = upload(chosen("surface"));
    const scale = (1.12 * look.zoom) / frame.radius;
    gl.useProgram(shader);
    gl.uniformMatrix3fv(uniforms.turn, false, turn());
    gl.uniform3fv(uniforms.centre, frame.centre);
    const narrow = Math.min(width, height);
    gl.uniform2f(uniforms.zoom, (scale * narrow) / width, (scale * narrow) / height);
    gl.uniform1f(uniforms.depth, 0.7 / frame.radius);
    gl.uniform1f(uniforms.dot_, Math.max(2, 2 * ratio * look.zoom));
    const colouring = colouringOf(scene.surfaces[chosen("surface")]);
    gl.uniform1i(uniforms.colouring, Math.min(colouring, 2));
    gl.uniform1i(uniforms.expected, colouring === 3 ? 1 : 0);
    gl.uniform1f(uniforms.range, Number(element("range").value) / scene.ranges[2]);
    gl.uniform3fv(uniforms.stops, STOPS.flatMap(hex));
    gl.uniform3fv(uniforms.clay, hex("#ded1c2"));
    gl.uniform3fv(uniforms.inferred, hex("#f09228"));
    gl.bindVertexArray(surface.array);
    if (surface.corners) gl.drawElements(gl.TRIANGLES, surface.corners, gl.UNSIGNED_INT, 0);
    else gl.drawArrays(gl.POINTS, 0, surface.vertices);
  }

  // ---- what the view shows, in words

  function describe() {
    const surface = scene.surfaces[chosen("surface")];
    const colouring = colouringOf(surface);
    const parts = colouring === 1 && surface.labels;
    element("key-parts").hidden = !parts;
    element("key-distance").hidden = colouring < 2;
    element("range-choice").hidden = colouring < 2;
    element("range-low").textContent = "0";
    element("range-high").textContent = `${element("range").value} ${scene.unit} and more`;
    const what = colouring === 3 ? "expected error" : `distance to ${surface.distance_to}`;
    element("range-of").textContent = what;
    const how = colouring >= 2 ? `coloured by ${what}` : parts ? "measured part light, inferred part orange" : "plain";
    const single = colouring === 1 && !parts ? " Only the completed surface has a measured and an inferred part." : "";
    const thinned = surface.thinned ? " Thinned for this view." : "";
    element("status").textContent = `${surface.name}, ${how}.${single}${thinned}`;
    canvas.setAttribute("aria-label", `3D view: ${surface.name}, ${how}. Arrow keys turn, plus and minus zoom, Home resets.`);
  }

  // ---- hands

  const TURN = 10;
  const ZOOM = 1.2;
  const acts = {
    left: () => (look.yaw -= TURN),
    right: () => (look.yaw += TURN),
    up: () => (look.pitch -= TURN),
    down: () => (look.pitch += TURN),
    closer: () => (look.zoom *= ZOOM),
    farther: () => (look.zoom /= ZOOM),
    reset: () => Object.assign(look, START),
  };
  const keys = {
    ArrowLeft: "left", ArrowRight: "right", ArrowUp: "up", ArrowDown: "down",
    "+": "closer", "=": "closer", "-": "farther", Home: "reset",
  };

  function act(name) {
    acts[name]();
    settle();
  }

  function settle() {
    look.pitch = Math.max(-90, Math.min(90, look.pitch));
    look.zoom = Math.max(0.4, Math.min(12, look.zoom));
    redraw();
  }

  canvas.addEventListener("keydown", (event) => {
    const name = keys[event.key];
    if (!name || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    act(name);
  });
  document.querySelectorAll("button[data-act]").forEach((button) => {
    button.addEventListener("click", () => act(button.dataset.act));
  });

  const fingers = new Map();
  const spread = () => {
    const [a, b] = [...fingers.values()];
    return Math.hypot(a.x - b.x, a.y - b.y);
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
  });
  canvas.addEventListener("pointermove", (event) => {
    const finger = fingers.get(event.pointerId);
    if (!finger) return;
    const before = fingers.size === 2 ? spread() : 0;
    const [dx, dy] = [event.clientX - finger.x, event.clientY - finger.y];
    [finger.x, finger.y] = [event.clientX, event.clientY];
    if (fingers.size === 1) {
      look.yaw += dx * 0.5;
      look.pitch += dy * 0.5;
    } else if (fingers.size === 2 && before > 0) {
      look.zoom *= spread() / before;
    }
    settle();
  });
  for (const kind of ["pointerup", "pointercancel", "lostpointercapture"]) {
    canvas.addEventListener(kind, (event) => fingers.delete(event.pointerId));
  }
  // The wheel zooms only a view that has the focus: a page must scroll past it.
  canvas.addEventListener("wheel", (event) => {
    if (document.activeElement !== canvas) return;
    event.preventDefault();
    look.zoom *= Math.exp(-event.deltaY * 0.0015);
    settle();
  }, { passive: false });

  element("viewer").addEventListener("change", () => {
    describe();
    redraw();
  });
  canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
  canvas.addEventListener("webglcontextrestored", () => {
    setUp();
    redraw();
  });
  new ResizeObserver(redraw).observe(canvas);

  const choice = (group, value, text, checked) => {
    const label = document.createElement("label");
    const input = document.createElement("input");
    Object.assign(input, { type: "radio", name: group, value, checked });
    label.append(input, " ", text);
    element(`${group}-choice`).append(label);
  };
  scene.surfaces.forEach((s, i) => choice("surface", i, s.name, i === scene.surfaces.length - 1));
  ["plain", "measured and inferred", "distance", "expected error"].forEach((text, i) => choice("colouring", i, text, i === 1));
  scene.ranges.forEach((range, i) => element("range").append(new Option(`0 to ${range} ${scene.unit}`, range, i === 1, i === 1)));
  element("scale-bar").style.background = `linear-gradient(to right, ${STOPS.join(", ")})`;
  setUp();
  describe();
  redraw();
})();

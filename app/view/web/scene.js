// SPDX-License-Identifier: BSD-3-Clause
"use strict";
// The surface, points until its mesh is there, and the recorded cameras as frusta, by three.js; what stands in while the camera moves.
const vertexShader = `
attribute vec3 colour; attribute float kelvin;
uniform float size;
varying vec3 seen; varying float known, knownKelvin;
void main() {
  vec4 p = modelViewMatrix * vec4(position, 1.0);
  gl_Position = projectionMatrix * p;
  gl_PointSize = clamp(size / -p.z, 1.5, 24.0);
  seen = colour; known = kelvin > 0.0 ? 1.0 : 0.0; knownKelvin = kelvin;
}`;
// Within a triangle, corners without a temperature (0) don't pull the others' down: their mean is that of the known ones.
const fragmentShader = `
uniform sampler2D palette;
uniform highp float low, high, share, isoLow, isoHigh; uniform int isotherm;
varying vec3 seen; varying highp float known, knownKelvin;
void main() {
  if (known < 0.5) { gl_FragColor = vec4(share >= 1.0 ? vec3(dot(seen, vec3(0.15))) : seen, 1.0); return; }
  highp float kelvin = knownKelvin / known, heat = clamp((kelvin - low) / max(1e-6, high - low), 0.0, 1.0);
  bool met = isotherm == 1 ? kelvin >= isoLow : isotherm == 2 ? kelvin <= isoHigh : kelvin >= isoLow && kelvin <= isoHigh;
  float weight = isotherm > 0 && share < 1.0 && !met ? 0.0 : share, marked = isotherm > 0 && share >= 1.0 && met ? 1.0 : 0.0;
  vec4 colour = texture2D(palette, vec2((heat * 255.0 + 0.5) / 256.0, 0.5));
  gl_FragColor = vec4(mix(mix(seen, colour.rgb, weight * colour.a), vec3(0.098, 0.89, 0.784), marked), 1.0);
}`;

class Surface {
  constructor(canvas, scene) {
    this.facts = scene;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: false, alpha: true, preserveDrawingBuffer: true });
    this.world = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(45, 1, scene.radius * 0.01, scene.radius * 100);
    this.camera.up.fromArray(scene.up);
    this.controls = new THREE.OrbitControls(this.camera, canvas);
    this.controls.screenSpacePanning = true;
    this.controls.minDistance = scene.radius * 0.05; this.controls.maxDistance = scene.radius * 10;
    this.controls.addEventListener("change", () => { this.draw(); this.onMove(); });
    this.onMove = () => {};
    this.frusta = { visible: null, thermal: null };
    this.share = 1;  // of the surface, drawn while the camera moves
    this.material = new THREE.ShaderMaterial({ vertexShader, fragmentShader, side: THREE.DoubleSide, uniforms: {
      size: { value: 1 }, low: { value: 0 }, high: { value: 1 }, share: { value: 0 }, isoLow: { value: 0 }, isoHigh: { value: 0 }, isotherm: { value: 0 }, palette: { value: null } } });
  }

  /// Vertices as app/view/surface.hpp has them, and where they end.
  vertices(bytes, at, scale) {
    const data = new DataView(bytes, at), count = data.getUint32(0, true);
    const low = [4, 8, 12].map(at => data.getFloat32(at, true)), step = [16, 20, 24].map(at => data.getFloat32(at, true));
    const places = new Uint16Array(bytes, at + 28, 3 * count), position = new Float32Array(3 * count);
    for (let i = 0; i < places.length; ++i) position[i] = low[i % 3] + step[i % 3] * places[i];
    const colour = new Uint8Array(bytes, at + 28 + 6 * count, 3 * count), after = at + 28 + 9 * count + (28 + 9 * count) % 2;
    const counts = new Uint16Array(bytes, after, count), kelvin = new Float32Array(count);
    for (let i = 0; i < count; ++i) kelvin[i] = counts[i] * scale;
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(position, 3));
    geometry.setAttribute("colour", new THREE.BufferAttribute(colour, 3, true));
    geometry.setAttribute("kelvin", new THREE.BufferAttribute(kelvin, 1));
    return { geometry, end: after + 2 * count };
  }

  addPoints(bytes) {
    this.points = new THREE.Points(this.vertices(bytes, 0, this.facts.surface.kelvin_per_count).geometry, this.material);
    this.points.frustumCulled = false;
    this.points.visible = !this.mesh;
    this.world.add(this.points);
    this.draw();
  }

  /// In the points' place: the surface, and what of it is drawn on a slow machine while the camera moves.
  addMesh(bytes) {
    const fine = this.meshFrom(bytes, 0);
    this.mesh = fine.mesh; this.coarse = this.meshFrom(bytes, fine.end).mesh;
    this.coarse.visible = false;
    if (this.points) this.points.visible = false;
    this.share = 1;
    this.draw();
  }
  meshFrom(bytes, at) {
    const data = new DataView(bytes, at), triangles = data.getUint32(0, true), { geometry, end } = this.vertices(bytes, at + 8, data.getFloat32(4, true));
    const corners = at + ((end - at + 3) & ~3);
    geometry.setIndex(new THREE.BufferAttribute(new Uint32Array(bytes, corners, 3 * triangles), 1));
    const mesh = new THREE.Mesh(geometry, this.material);
    mesh.frustumCulled = false;
    this.world.add(mesh);
    return { mesh, end: corners + 12 * triangles };
  }

  /// The mesh at a place of the stage given as shares; null where there is none.
  meshAt(u, v) {
    if (!this.mesh) return null;
    const ray = new THREE.Raycaster();
    ray.setFromCamera({ x: 2 * u - 1, y: 1 - 2 * v }, this.camera);
    const [hit] = ray.intersectObject(this.mesh);
    return hit ? hit.point.toArray() : null;
  }

  addFrusta() {
    const colours = { visible: [0.29, 0.64, 1], thermal: [1, 0.54, 0.31], doubt: [1, 0.83, 0] };
    const size = this.facts.radius * 0.07;
    for (const modality of ["visible", "thermal"]) {
      const position = [], colour = [];
      for (const view of this.facts.views) {
        if (view.modality !== modality) continue;
        const matrix = new THREE.Matrix4().compose(new THREE.Vector3(...view.position), quaternionOf(view), new THREE.Vector3(1, 1, 1));
        const h = size * Math.tan(view.fov_deg * Math.PI / 360), w = h * view.aspect;
        const corner = [[-w, -h], [w, -h], [w, h], [-w, h]].map(([x, y]) => new THREE.Vector3(x, y, -size).applyMatrix4(matrix));
        const top = new THREE.Vector3(0, h * 1.5, -size).applyMatrix4(matrix), eye = new THREE.Vector3(...view.position);
        view.mark = new THREE.Vector3(0, 0, -size).applyMatrix4(matrix);
        const lines = [[eye, corner[0]], [eye, corner[1]], [eye, corner[2]], [eye, corner[3]], [corner[0], corner[1]], [corner[1], corner[2]], [corner[2], corner[3]], [corner[3], corner[0]], [corner[2], top], [top, corner[3]]];
        // Crossed out: its pose is in doubt, whatever the colours look like to the reader.
        if (view.doubt) lines.push([corner[0], corner[2]], [corner[1], corner[3]]);
        for (const [a, b] of lines) { position.push(a.x, a.y, a.z, b.x, b.y, b.z); for (let i = 0; i < 2; ++i) colour.push(...colours[view.doubt ? "doubt" : modality]); }
      }
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.Float32BufferAttribute(position, 3));
      geometry.setAttribute("color", new THREE.Float32BufferAttribute(colour, 3));
      this.frusta[modality] = new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ vertexColors: THREE.VertexColors }));
      this.frusta[modality].frustumCulled = false;
      this.world.add(this.frusta[modality]);
    }
    this.draw();
  }

  /// The recorded camera whose frustum is within a finger's breadth of the place on the screen.
  cameraAt(x, y) {
    let best = null, nearest = 22;
    this.facts.views.forEach((view, index) => {
      if (!this.frusta[view.modality].visible) return;
      for (const point of [view.mark, new THREE.Vector3(...view.position)]) {
        const at = this.onScreen(point);
        if (at && Math.hypot(at.x - x, at.y - y) < nearest) { nearest = Math.hypot(at.x - x, at.y - y); best = index; }
      }
    });
    return best;
  }

  onScreen(point) {
    const p = point.clone().project(this.camera);
    return p.z > -1 && p.z < 1 ? { x: (p.x + 1) / 2 * this.width, y: (1 - p.y) / 2 * this.height } : null;
  }

  resize(width, height) {
    const first = !this.width;
    this.width = width; this.height = height;
    this.renderer.setPixelRatio(Math.min(2, window.devicePixelRatio || 1));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height; this.camera.updateProjectionMatrix();
    if (first) this.reset(); else this.draw();
  }

  /// Under a rendered picture the points only say what hides a frustum.
  behindPicture(yes) {
    if (this.material.colorWrite !== yes) return;
    this.material.colorWrite = !yes;
    this.draw();
  }

  /// layer: visible, thermal, or both by the overlay's opacity.
  style(layer) {
    const u = this.material.uniforms;
    if (!this.facts.surface.colored && this.facts.surface.temperatures) u.share.value = 1;
    // 1: temperatures alone. The heat picture shows the visible one where it has none.
    else u.share.value = { visible: 0, thermal: 1, fused: 0.99, mix: Math.min(0.99, show.opacity) }[layer];
    const scale = scaleOf(layer) || scaleOf("thermal");
    u.low.value = scale.low; u.high.value = scale.high; u.isoLow.value = show.isoLow; u.isoHigh.value = show.isoHigh;
    u.isotherm.value = layer === "thermal" || layer === "mix" ? ["off", "above", "below", "between"].indexOf(show.isotherm) : 0;
    if (u.palette.value) u.palette.value.dispose();
    // Of each colour how strongly it is laid over the visible one, as in the heat picture.
    const table = Uint8Array.from({ length: 1024 }, (_, i) => i % 4 < 3 ? scale.colours[3 * (i >> 2) + i % 4] : scale.strengths ? scale.strengths[i >> 2] : 255);
    u.palette.value = new THREE.DataTexture(table, 256, 1, THREE.RGBAFormat);
    u.palette.value.needsUpdate = true;
    this.draw();
  }

  draw() {
    if (this.asked || !this.width) return;
    this.asked = true;
    requestAnimationFrame(() => {
      this.asked = false;
      // Points lie in no order, so that the first of them are spread over the whole.
      const share = this.moving ? this.share : 1, begun = performance.now();
      if (this.mesh) { this.coarse.visible = share < 1; this.mesh.visible = share === 1; }
      else if (this.points) this.points.geometry.setDrawRange(0, Math.ceil(share * this.facts.surface.points));
      this.material.uniforms.size.value = this.facts.radius * 0.004 / Math.sqrt(share) * this.renderer.domElement.height / Math.tan(this.camera.fov * Math.PI / 360);
      this.renderer.render(this.world, this.camera);
      if (!this.moving || !(this.points || this.mesh)) return;
      // A pixel that is read back waits for the picture.
      const gl = this.renderer.getContext();
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
      this.keepPace(performance.now() - begun);
    });
  }

  /// A movement begins: one that was drawn quickly is tried in whole again.
  moves() {
    if (!this.moving && this.mesh && this.quick) this.share = 1;
    this.moving = true;
  }

  /// Less of the surface where this machine draws fewer than 30 pictures a second, more where it has time.
  keepPace(taken_ms) {
    if (this.mesh) {
      const all = this.mesh.geometry.index.count, few = this.coarse.geometry.index.count;
      if (this.share === 1 && taken_ms > 25) this.share = few / all;
      else if (this.share < 1) this.quick = taken_ms < 12;
    } else if (taken_ms > 25) this.share = Math.max(0.02, this.share * Math.max(0.3, 20 / taken_ms));
    else if (taken_ms < 12) this.share = Math.min(1, this.share * 1.1);
  }

  reset() {
    const up = new THREE.Vector3(...this.facts.up), center = new THREE.Vector3(...this.facts.center);
    const first = this.facts.views.length ? new THREE.Vector3(...this.facts.views[0].position) : center.clone().add(new THREE.Vector3(1, 0, 0.4));
    const away = first.sub(center).addScaledVector(up, 0.15 * this.facts.radius).setLength(this.facts.radius * 1.05 * Math.min(2.2, Math.max(1, 1 / this.camera.aspect)));
    this.stand({ position: center.clone().add(away).toArray(), target: center.toArray(), fov_deg: 45 });
  }

  /// Where the camera stands, as bookmarks keep it.
  pose() { return { position: this.camera.position.toArray(), target: this.controls.target.toArray(), fov_deg: this.camera.fov }; }

  stand(pose) {
    this.camera.position.fromArray(pose.position); this.controls.target.fromArray(pose.target);
    this.camera.fov = pose.fov_deg; this.camera.updateProjectionMatrix();
    this.controls.update(); this.draw(); this.onMove(true);
  }

  /// As a recorded camera looks; its roll is left out, so that turning on stays level.
  standAt(view) {
    const position = new THREE.Vector3(...view.position), ahead = new THREE.Vector3(0, 0, -1).applyQuaternion(quaternionOf(view));
    const reach = Math.max(0.2 * this.facts.radius, new THREE.Vector3(...this.facts.center).sub(position).dot(ahead));
    this.stand({ position: view.position, target: position.addScaledVector(ahead, reach).toArray(), fov_deg: view.fov_deg });
  }

  /// For the server: app/view/shot_request.hpp.
  shot(width, height) {
    this.camera.updateMatrixWorld();
    const p = this.camera.position, q = this.camera.quaternion;
    return { position: [p.x, p.y, p.z], rotation_wxyz: [q.w, q.x, q.y, q.z], fov_deg: this.camera.fov, width, height };
  }
}
const quaternionOf = view => { const [w, x, y, z] = view.rotation_wxyz; return new THREE.Quaternion(x, y, z, w); };

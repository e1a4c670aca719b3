// Sliders for the textile of a sheet. Values are SI; what is shown is SI times `scale`.
'use strict';

// Field, label, unit shown, scale, smallest and largest value of the slider.
const kMeasured = [
  ['areal_density_kg_per_m2', 'Weight', 'g/m²', 1e3, 0.01, 2],
  ['tensile_warp_n_per_m', 'Stretch, warp', 'N/m', 1, 10, 1e5],
  ['tensile_weft_n_per_m', 'Stretch, weft', 'N/m', 1, 10, 1e5],
  ['shear_n_per_m', 'Shear', 'N/m', 1, 1, 1e4],
  ['bend_rigidity_warp_n_m', 'Bending, warp', 'µN m', 1e6, 1e-7, 1e-2],
  ['bend_rigidity_weft_n_m', 'Bending, weft', 'µN m', 1e6, 1e-7, 1e-2],
  ['air_drag_kg_per_m2_s', 'Air drag', 'kg/(m² s)', 1, 1e-3, 10],
];
const kRaw = [
  ['particle_mass_kg', 'Mass of a particle', 'g', 1e3, 1e-6, 0.1],
  ['stretch_n_per_m', 'Stretch', 'N/m', 1, 10, 1e5],
  ['shear_n_per_m', 'Shear', 'N/m', 1, 1, 1e5],
  ['bend_n_m2', 'Bending', 'µN m²', 1e6, 1e-8, 1e-2],
  ['air_drag_kg_per_s', 'Air drag', 'g/s', 1e3, 1e-6, 0.1],
];
const kBoth = [
  ['damping_kg_per_s', 'Damping', 'g/s', 1e3, 1e-6, 1],
  ['friction_coefficient', 'Friction', '', 1, 0, 2],
];
const kNeverNone = ['areal_density_kg_per_m2', 'particle_mass_kg'];
const kSteps = 1000;
const kChosen = 'auto';  // where a textile leaves a value to the server

// A number as one would write it, with three digits.
const short = (value) => String(Number(value.toPrecision(3)));

// Places of a slider: in equal ratios, 0 at its left end; from 0 on in equal steps.
function scaleOf(low, high, hasNone) {
  if (low === 0) {
    return {valueAt: (place) => high * place / kSteps, placeOf: (value) => kSteps * Math.min(1, value / high)};
  }
  const first = hasNone ? 1 : 0;
  const span = Math.log(high / low);
  return {
    valueAt: (place) => (place < first ? 0 : low * Math.exp(span * (place - first) / (kSteps - first))),
    placeOf: (value) => (value < low ? (value > 0 ? first : 0)
      : Math.min(kSteps, Math.round(first + (kSteps - first) * Math.log(value / low) / span))),
  };
}

class TextilePanel {
  // `apply` sends an UpdateTextileRequest's sheet, textile and mask, and returns the answer.
  constructor(apply) {
    this.apply = apply;
    this.wanted = new Map();  // fields whose newest values are not sent yet
    this.fields = new Map();
    $('preset').addEventListener('change', () => this.take($('preset').value));
    $('sheet').addEventListener('change', () => this.fill());
  }

  // The sheets of a scene.
  show(sheets) {
    this.sheets = sheets;
    this.wanted.clear();
    $('sheet').replaceChildren(...sheets.map(({name}) => cell('option', name, {value: name})));
    $('sheet').closest('label').hidden = sheets.length < 2;
    $('applied').textContent = '';
    this.fill();
  }

  get sheet() { return this.sheets.find(({name}) => name === $('sheet').value); }

  // Presets that lack no number.
  offer(textiles) {
    const options = textiles.filter(({missing}) => missing.length === 0)
      .map(({name, display_name}) => cell('option', display_name, {value: name}));
    $('preset').replaceChildren(cell('option', 'take one …', {value: ''}), ...options);
  }

  fill() {
    const {textile} = this.sheet;
    const model = textile.raw ? 'raw' : 'measured';
    this.fields.clear();
    const rows = [...(textile.raw ? kRaw : kMeasured).map((field) => this.slider(field, textile[model], `${model}.`)),
      ...kBoth.map((field) => this.slider(field, textile, ''))];
    $('sliders').replaceChildren(...rows);
  }

  slider([name, label, unit, scale, low, high], values, prefix) {
    const value = values[name];
    const path = prefix + name;
    const {valueAt, placeOf} = scaleOf(
      low, Math.max(high, value ?? 0), !kNeverNone.includes(name));
    const made = document.createElement('div');
    made.className = 'slider';
    const range = cell('input', '', {type: 'range', min: 0, max: kSteps, step: 1, 'aria-label': label, 'data-field': name});
    const number = cell('input', '', {class: 'number', inputmode: 'decimal', size: 7, placeholder: kChosen, 'aria-label': `${label}, ${unit || 'number'}`});
    const set = (to) => {
      range.value = to === undefined ? 0 : placeOf(to);
      number.value = to === undefined ? '' : short(to * scale);
      range.setAttribute('aria-valuetext', to === undefined ? kChosen : `${number.value} ${unit}`);
    };
    set(value);
    range.addEventListener('input', () => {
      const to = Number(valueAt(Number(range.value)).toPrecision(3));
      number.value = short(to * scale);
      this.want(path, label, to, `${number.value} ${unit}`);
    });
    number.addEventListener('change', () => {
      const to = Number(number.value.replace(',', '.')) / scale;
      if (!Number.isFinite(to) || number.value.trim() === '') return this.restore(path);
      range.value = placeOf(to);
      this.want(path, label, to, `${short(to * scale)} ${unit}`);
    });
    made.append(cell('span', label), range, number, cell('span', unit, {class: 'unit'}));
    this.fields.set(path, {set, of: (textile) => (prefix ? textile[prefix.slice(0, -1)] : textile)[name]});
    return made;
  }

  restore(path) {
    const {set, of} = this.fields.get(path);
    set(of(this.sheet.textile));
  }

  // Sends the newest values, one request at a time.
  async want(path, label, value, text) {
    this.wanted.set(path, {value, said: `${label} ${text}`.trim()});
    if (this.sending) return;
    this.sending = true;
    while (this.wanted.size > 0) {
      const wanted = [...this.wanted];
      this.wanted.clear();
      const textile = {};
      for (const [place, {value: number}] of wanted) {
        const [model, field] = place.includes('.') ? place.split('.') : [null, place];
        if (model) (textile[model] ??= {})[field] = number; else textile[field] = number;
      }
      await this.send(textile, wanted.map(([place]) => place), wanted.map(([, {said}]) => said).join(', '));
    }
    this.sending = false;
  }

  // A preset; damping and friction stay.
  async take(preset) {
    if (!preset) return;
    const {damping_kg_per_s, damping_ratio, friction_coefficient} = this.sheet.textile;
    const chosen = $('preset').selectedOptions[0].textContent;
    if (await this.send({preset, damping_kg_per_s, damping_ratio, friction_coefficient}, [], chosen)) this.fill();
    $('preset').value = '';
  }

  async send(textile, paths, said) {
    const {sheet} = this;
    try {
      const request = {sheet: sheet.name, textile};
      if (paths.length > 0) request.update_mask = paths.join(',');
      const answer = await this.apply(request);
      sheet.textile = answer.textile;
      $('applied').textContent = `${said}: from frame ${answer.applied_frame} on. A frame takes ` +
        `${answer.plan.substeps_per_frame} substeps.`;
      return true;
    } catch {
      for (const path of paths) if (this.fields.has(path) && !this.wanted.has(path)) this.restore(path);
      return false;
    }
  }
}

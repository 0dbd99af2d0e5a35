// The columns of a table that was dropped: what each is, and in which unit.
import { t } from "./texts.js";

const $ = (id) => document.getElementById(id);
const ROLES = ["", "t", "theta", "Omega", "Y", "Z", "beta", "input"];
const KINDS = { "t theta": "pendulum", "Omega t": "gyroscope", "Y Z beta t": "disk" };

export class Columns {
  /** `changed` is called when a choice has changed. */
  constructor(changed) {
    this.changed = changed;
    this.hide();
  }

  hide() {
    $("columns").hidden = true;
    this.found = null;
  }

  show(found) {
    this.found = found;
    this.touched = false;
    $("columns").hidden = false;
    const table = $("column-table");
    table.replaceChildren();
    const headings = table.createTHead().insertRow();
    const body = table.createTBody();
    const roles = body.insertRow(), units = body.insertRow();
    this.selects = found.columns.map((column) => {
      const th = document.createElement("th");
      th.scope = "col";
      th.textContent = column.heading;
      headings.append(th);
      const role = select(`${column.heading}: ${t("loop_role")}`, ROLES.map((r) => [t(`role_${r}`), r]));
      const unit = select(`${column.heading}: ${t("loop_unit")}`, []);
      role.value = column.guess;
      const offer = () => {
        const known = found.units[role.value] ?? [];
        unit.replaceChildren(...known.map((u) => new Option(u || t("unit_as_recorded"), u)));
        unit.value = known.includes(column.unit) ? column.unit : known[0] ?? "";
        unit.hidden = !known.length;
      };
      offer();
      for (const [one, act] of [[role, offer], [unit, () => {}]]) {
        one.addEventListener("change", () => {
          act();
          this.touched = true;
          this.changed();
        });
      }
      roles.insertCell().append(role);
      units.insertCell().append(unit);
      return [role, unit];
    });
    for (let k = 0; k < (found.columns[0]?.cells.length ?? 0); k++) {
      const row = body.insertRow();
      for (const column of found.columns) row.insertCell().textContent = column.cells[k] ?? "";
    }
    table.createCaption().textContent = t("loop_rows", { n: found.rows });
  }

  /** Whether the table is understood as it stands. */
  get plain() {
    return !this.touched && !this.roles.includes("input") && ["disk", "pendulum", "gyroscope"].includes(this.found.kind);
  }

  /** The roles that are chosen. */
  get roles() {
    return this.selects.map(([role]) => role.value).filter(Boolean);
  }

  /** Whether a column is what drives the machine. */
  get driven() {
    return this.roles.includes("input");
  }

  /** What the choice makes: "disk", "pendulum", "gyroscope", or nothing. */
  get kind() {
    if (this.plain) return this.found.kind;
    const motion = [...this.roles].sort();
    if (this.driven) motion.splice(motion.indexOf("input"), 1); // a second one makes no kind
    return KINDS[motion.join(" ")] ?? "";
  }

  /** Whether the unit of a measured drive speed is missing. */
  get unitMissing() {
    return this.kind === "disk" && this.driven && this.selects.some(([role, unit]) => role.value === "input" && !unit.value);
  }

  /** The choice as the server reads it; nothing if the table is understood as it stands. */
  get chosen() {
    if (this.plain) return [];
    return this.selects
      .map(([role, unit], k) => [role.value, this.found.columns[k].heading, unit.value])
      .filter(([role]) => role);
  }
}

function select(label, options) {
  const made = document.createElement("select");
  made.setAttribute("aria-label", label);
  made.replaceChildren(...options.map(([text, value]) => new Option(text, value)));
  return made;
}

// The scenario file as text, with line numbers and the line of a problem.

import { firstDifference, lineAt, rangeOfLine } from "../model/draft.js";
import { attribute, byId, text } from "../ui/dom.js";

export class Source {
  #field = byId("edit-text");
  #gutter = byId("edit-gutter");
  #problem = null;

  /** Calls `typed(text)` after each change by a person. */
  constructor(typed) {
    this.#field.addEventListener("input", () => {
      this.#number();
      typed(this.#field.value);
    });
    this.#field.addEventListener("scroll", () => this.#align());
    byId("edit-line").addEventListener("click", () => this.#go());
  }

  /** Shows a text. If it differs from the shown one, the first change scrolls into view. */
  show(wanted) {
    const { value, selectionStart } = this.#field;
    if (value === wanted) return;
    const at = firstDifference(value, wanted);
    this.#field.value = wanted;
    this.#number();
    this.#field.setSelectionRange(Math.min(selectionStart, wanted.length), Math.min(selectionStart, wanted.length));
    if (value !== "") this.#reveal(lineAt(wanted, at));
  }

  /** Shows a problem: `{text, line}`, `line` may be null. Without a problem, `state` is shown. */
  showProblem(problem, state) {
    this.#problem = problem;
    attribute(byId("edit-state"), "data-problem", problem !== null);
    attribute(this.#field, "aria-invalid", problem?.line ? "true" : null);
    text(byId("edit-state"), problem?.text ?? state);
    byId("edit-line").hidden = !problem?.line;
    this.#number();
  }

  /** Selects the line of the problem. */
  #go() {
    const [start, end] = rangeOfLine(this.#field.value, this.#problem.line);
    this.#field.focus();
    this.#field.setSelectionRange(start, end);
    this.#reveal(this.#problem.line);
  }

  #number() {
    const lines = this.#field.value.split("\n").length;
    const mark = (line) => (line === this.#problem?.line ? `▶${line}` : `${line}`);
    text(this.#gutter, Array.from({ length: lines }, (_, at) => mark(at + 1)).join("\n"));
    this.#align();
  }

  #align() {
    this.#gutter.style.translate = `0 ${-this.#field.scrollTop}px`;
  }

  /** Scrolls to a line, unless it is visible. */
  #reveal(line) {
    const height = Number.parseFloat(getComputedStyle(this.#field).lineHeight);
    const top = (line - 1) * height;
    const { scrollTop, clientHeight } = this.#field;
    if (top < scrollTop || top > scrollTop + clientHeight - 2 * height) this.#field.scrollTop = top - clientHeight / 3;
  }
}

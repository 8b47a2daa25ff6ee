// What the client throws.

/** Anything that went wrong between here and tractiond; one sentence for people. */
export class TractionError extends Error {
  /** @param code of docs/clients.md: "malformed", "no_answer" ... */
  constructor(code, text) {
    super(text);
    this.name = "TractionError";
    this.code = code;
  }
}

export const malformed = (what) => new TractionError("malformed", what);

/** Requests to the service that served the page, and its refusals as sentences. */

export interface Fault {
  pointer: string;
  detail: string;
}

export class Refusal extends Error {
  readonly status: number;
  readonly outcome: string;
  readonly faults: Fault[];

  constructor(status: number, detail: string, outcome: string, faults: Fault[]) {
    super(detail);
    this.status = status;
    this.outcome = outcome;
    this.faults = faults;
  }
}

/** The server did not answer at all. */
export class Unreachable extends Error {}

const KEY = "veselova-key";

let key = "";
try {
  key = sessionStorage.getItem(KEY) ?? "";
} catch {
  // The browser blocks storage: the key lives as long as the page.
}

/** The API key of this session of the browser; empty without one. */
export const apiKey = {
  get: (): string => key,
  set: (text: string): void => {
    key = text.trim();
    try {
      sessionStorage.setItem(KEY, key);
    } catch {
      // As above.
    }
  },
};

/** Return the answer to a POST, JSON or a table as text; throws Refusal or Unreachable. */
export async function post<T>(
  path: string,
  body: unknown,
  signal?: AbortSignal,
  accept = "application/json",
): Promise<T> {
  const headers: Record<string, string> = { "Content-Type": "application/json", Accept: accept };
  if (apiKey.get()) headers.Authorization = `Bearer ${apiKey.get()}`;
  let response: Response;
  try {
    response = await fetch(path, {
      method: "POST",
      headers,
      body: JSON.stringify(body),
      signal: signal ?? null,
    });
  } catch (error) {
    if (signal?.aborted) throw error;
    throw new Unreachable("The server does not answer.");
  }
  const table = response.ok && accept === "text/csv";
  const answer: unknown = await (table ? response.text() : response.json()).catch(() => null);
  if (response.ok && answer) return answer as T;
  const { detail, outcome, errors } = (answer ?? {}) as {
    detail?: string;
    outcome?: string;
    errors?: Fault[];
  };
  const sentence = detail ?? `The server answered with status ${response.status}.`;
  throw new Refusal(response.status, sentence, outcome ?? "", errors ?? []);
}

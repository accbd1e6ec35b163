// The signed-in role and its orders. An order without a role first asks for one, once.

import { byId, element, write } from "./dom.js";

let session = { orders: false, roles: [], csrf: null };
let then = null; // what is to be done after the next sign-in

/** Ask who is signed in; where not even reading is open, ask for a role at once. */
export async function readSession() {
  const answer = await asked("GET", "/api/session");
  take(answer);
  if (answer.status === 200 && !session.reads) openDialog();
}

/** Order something; an outcome or a refusal goes to `told`. */
export async function order(name, parameters, told) {
  if (!session.orders) {
    then = () => order(name, parameters, told);
    openDialog();
    return;
  }
  const { status, content } = await asked("POST", `/api/cmd/${name}`, parameters);
  if (status === 401) {
    session = { ...session, orders: false, role: null };
    showSession();
    then = () => order(name, parameters, told);
    openDialog();
  } else {
    told(content.error ? `${name.replaceAll("_", " ")}: ${content.error}` : "");
  }
}

/** Connect the buttons of the dialog; `changed` is called after a sign-in or sign-out. */
export function connectSession(changed) {
  byId("sign").addEventListener("click", async () => {
    if (session.role) {
      take(await asked("DELETE", "/api/session"));
      changed();
    } else openDialog();
  });
  byId("sign-cancel").addEventListener("click", () => byId("sign-in").close());
  byId("sign-in").addEventListener("close", () => { byId("password").value = ""; then = null; });
  byId("sign-form").addEventListener("submit", async (submitted) => {
    submitted.preventDefault();
    byId("sign-now").disabled = true;
    const { status, content } = await asked("POST", "/api/session", { role: byId("role").value, name: byId("who").value, password: byId("password").value });
    byId("sign-now").disabled = false;
    if (status !== 200) {
      write(byId("sign-error"), content.error ?? "refused");
      byId("password").select();
      return;
    }
    take({ status, content });
    const next = then;
    byId("sign-in").close();
    changed();
    next?.();
  });
}

function openDialog() {
  write(byId("sign-error"), session.roles.length ? "" : "sign-in is off: the ground station has no passwords");
  byId("sign-now").disabled = !session.roles.length;
  byId("role").replaceChildren(...session.roles.map((role) => element("option", { value: role }, role)));
  byId("sign-in").showModal();
}

function take({ status, content }) {
  if (status === 200) session = content;
  showSession();
}

function showSession() {
  write(byId("sign"), session.role ? `Sign out ${session.name}` : "Sign in");
}

async function asked(method, address, body) {
  const headers = { "x-csrf-token": session.csrf ?? "" };
  if (body) headers["content-type"] = "application/json";
  try {
    const response = await fetch(address, { method, headers, body: body && JSON.stringify(body), credentials: "same-origin" });
    return { status: response.status, content: await response.json() };
  } catch {
    return { status: 0, content: { error: "the ground station does not answer" } };
  }
}

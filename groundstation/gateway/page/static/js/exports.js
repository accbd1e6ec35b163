// The hole or the wall as a file of another program; a refusal is told where the button is.

import { byId, element, write } from "./dom.js";

/** Connect the form that exports. */
export function connectExports() {
  byId("export").addEventListener("submit", async (submitted) => {
    submitted.preventDefault();
    write(byId("exported"), await exported(address()));
  });
}

/** Offer the wall where there is one; its file says where it stands. */
export function offerWall(hasWall) {
  byId("export-wall").hidden = byId("export-wall").disabled = !hasWall;
  byId("export-origin").disabled = hasWall;
}

function address() {
  const asked = new URLSearchParams();
  if (byId("export-origin").value && !byId("export-origin").disabled) asked.set("origin", byId("export-origin").value);
  if (byId("export-grid").value) asked.set("grid_crs", byId("export-grid").value);
  return `/api/exports/${byId("export-what").value}.${byId("export-format").value}?${asked}`;
}

/** Ask for a file and have the browser save it; the line that says what became of it. */
async function exported(where) {
  try {
    const response = await fetch(where, { credentials: "same-origin" });
    if (response.status !== 200) return (await response.json()).error ?? "refused";
    const name = /filename="([^"]+)"/.exec(response.headers.get("content-disposition"))[1];
    const href = URL.createObjectURL(await response.blob());
    element("a", { href, download: name }).click();
    setTimeout(() => URL.revokeObjectURL(href), 60_000);
    return name;
  } catch {
    return "the ground station does not answer";
  }
}

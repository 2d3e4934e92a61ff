// Starts the page. Where a network comes or goes, single files fail to load, and browsers do not try them
// again: the page would wait for a connection for good. It is loaded anew until all of it is there.

const PAUSE = 2_000;

try {
  await import("./main.js");
} catch (error) {
  // Anything else is a fault of the page, which loading it anew would hide.
  if (!(error instanceof TypeError)) throw error;
  document.getElementById("link-word").textContent = "Not loaded";
  document.getElementById("link-detail").textContent = "trying again";
  setTimeout(() => location.reload(), PAUSE);
}

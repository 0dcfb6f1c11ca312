// What every page needs: going to another data set, and a list of the keys that a page knows.
const choice = document.getElementById("data-set");
choice?.addEventListener("change", () => { location.href = choice.value; });

const keys = document.getElementById("keys");
const toggle = () => { if (keys.open) keys.close(); else keys.showModal(); };
if (keys) {
  document.addEventListener("keydown", (event) => {
    if (event.key !== "?" || event.ctrlKey || event.metaKey || event.altKey || event.target.matches("input, select, textarea")) return;
    event.preventDefault();
    toggle();
  });
  for (const button of document.querySelectorAll('[data-opens="keys"]')) button.addEventListener("click", toggle);
  keys.addEventListener("click", (event) => { if (event.target === keys) keys.close(); }); // beside it
}

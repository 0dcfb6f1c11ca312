// The colours of the legend, and copying the lines of Python.
for (const each of document.querySelectorAll(".colour")) each.style.background = each.dataset.colour;

document.getElementById("copy").addEventListener("click", async () => {
  const text = document.getElementById("python"), said = document.getElementById("copied");
  try { await navigator.clipboard.writeText(text.textContent); said.textContent = "Copied."; }
  catch { getSelection().selectAllChildren(text); said.textContent = "Selected; copy with the keyboard."; }
});

// What every page needs: going to another data set.
const choice = document.getElementById("data-set");
choice?.addEventListener("change", () => { location.href = choice.value; });

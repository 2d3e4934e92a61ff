const box = document.querySelector('.search');
const input = box.querySelector('input');
const rows = [...document.querySelectorAll('tbody tr')];
box.hidden = false;
input.addEventListener('input', () => {
  const words = input.value.toLowerCase().split(/\s+/).filter(Boolean);
  for (const row of rows) {
    const text = row.textContent.toLowerCase();
    row.hidden = !words.every((word) => text.includes(word));
  }
  for (const table of document.querySelectorAll('.wide')) {
    table.classList.toggle('empty', !table.querySelector('tbody tr:not([hidden])'));
  }
});

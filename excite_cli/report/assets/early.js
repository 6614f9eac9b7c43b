document.documentElement.classList.add("loading")

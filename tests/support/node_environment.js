// Gives a test program of WebAssembly the environment variables of node.
Module["preRun"] = () => Object.assign(ENV, process.env);

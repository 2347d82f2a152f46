// SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
// SPDX-License-Identifier: GPL-3.0-or-later

/* Flamenco's job type for the faces of a WildCap batch, in ES5.1; docs/farm.md says how to install it and how to submit.
 *
 * Each face is a chain of tasks, as core/batch/groups.py has them. A task runs `PYTHON WILDCAP batch task BATCH FACE TASK`, and every path is an argument
 * of its own: so Flamenco's variables can give each platform its own. What is done already ends within seconds: a job may be submitted again at any time. */

var JOB_TYPE = {
    label: "WildCap Faces",
    description: "Faces of a WildCap batch, from film to relightable head",
    settings: [
        {key: "batch", type: "string", subtype: "dir_path", required: true,
         description: "Folder of the batch, on storage that all workers see"},
        {key: "faces", type: "string", required: true,
         description: "Names of the faces, with slashes between them, which no name can hold: Anna/José/Smith, John"},
        {key: "part", type: "string", choices: ["all", "to the masks", "from the masks"], "default": "all",
         description: "Where an artist looks at the shadow masks: up to them, and from them on in a second job"},
        {key: "python", type: "string", "default": "{wildcap_python}",
         description: "The solver's Python on the workers; a variable of the Manager"},
        {key: "wildcap", type: "string", "default": "{wildcap}",
         description: "WildCap's folder on the workers, the one that holds core; a variable of the Manager"},
        {key: "task_type", type: "string", "default": "misc",
         description: "Type of the tasks that a GPU does not make faster; a worker's task_types say which it takes"},
        {key: "gpu_task_type", type: "string", "default": "misc",
         description: "Type of the tasks that a GPU makes faster: mask and solve"}
    ]
};

// Where the artist's gate lies: before the first that belongs to "from the masks".
var TASKS = [
    {name: "head", part: "to the masks", onGpu: false},
    {name: "mask", part: "to the masks", onGpu: true},
    {name: "solve", part: "from the masks", onGpu: true},
    {name: "deliver", part: "from the masks", onGpu: false}
];

function compileJob(job) {
    var settings = readSettings(job.settings);
    var faces = readFaces(settings.faces);
    var i, j, task, before;
    for (i = 0; i < faces.length; i++) {
        before = null;
        for (j = 0; j < TASKS.length; j++) {
            if (settings.part !== "all" && settings.part !== TASKS[j].part) {
                continue;
            }
            task = makeTask(settings, faces[i], TASKS[j]);
            if (before) {
                task.addDependency(before);
            }
            job.addTask(task); // keeps the task as it is now
            before = task;
        }
    }
}

function makeTask(settings, face, step) {
    var task = author.Task(face + "." + step.name, step.onGpu ? settings.gpu_task_type : settings.task_type);
    task.addCommand(author.Command("exec", {
        exe: settings.python,
        args: [settings.wildcap, "batch", "task", settings.batch, face, step.name]
    }));
    return task;
}

/* What was submitted, with the defaults where nothing was: only the add-on fills them in by itself. */
function readSettings(given) {
    var read = {};
    var i, known, value;
    for (i = 0; i < JOB_TYPE.settings.length; i++) {
        known = JOB_TYPE.settings[i];
        value = given[known.key];
        if (value === undefined || value === null || value === "") {
            value = known["default"];
        }
        if (typeof value !== "string" || value.trim() === "") {
            throw new Error("The setting " + known.key + " is empty or no text. Fill it in: " + known.description + ".");
        }
        if (known.choices && known.choices.indexOf(value) < 0) {
            throw new Error("The setting " + known.key + " is \"" + value + "\". It can be: " + known.choices.join(", ") + ".");
        }
        read[known.key] = value;
    }
    return read;
}

/* The names, as they are: a blank may belong to one. */
function readFaces(text) {
    var faces = text.split("/");
    var i;
    for (i = 0; i < faces.length; i++) {
        if (faces[i].trim() === "" || faces[i].charAt(0) === "-" || /[\\\n\r\t]/.test(faces[i])) {
            throw new Error("The setting faces holds \"" + faces[i] + "\", which is no face's name. Write names with one slash between them: Anna/Bert.");
        }
        if (faces.indexOf(faces[i]) !== i) {
            throw new Error("The setting faces names " + faces[i] + " twice. Name each face once: two tasks cannot work on it at the same time.");
        }
    }
    return faces;
}

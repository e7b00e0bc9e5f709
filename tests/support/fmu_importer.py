"""An FMU in FMPy, call by call."""

import shutil

import fmpy
from fmpy.fmi2 import FMU2Model, FMU2Slave


class Importer:
    """An instance of an FMU for one kind of interface, through initialization at time 0."""

    def __init__(self, path, model_exchange=False, begin=True, **times):
        self.description = fmpy.read_model_description(str(path))
        self.folder = fmpy.extract(str(path))
        self.references = {each.name: each.valueReference for each in self.description.modelVariables}
        self.fmu = (FMU2Model if model_exchange else FMU2Slave)(
            guid=self.description.guid, unzipDirectory=self.folder, instanceName="one",
            modelIdentifier=self.description.coSimulation.modelIdentifier,
        )  # fmt: skip
        self.fmu.instantiate()
        if begin:
            self.begin(**times)

    def begin(self, **times):
        """Go through initialization, from time 0 where no other is given."""
        self.fmu.setupExperiment(**{"startTime": 0.0, **times})
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.fmu.freeInstance()
        shutil.rmtree(self.folder, ignore_errors=True)

    def give(self, **values):
        references = [self.references[name] for name in values]
        self.fmu.setReal(references, list(values.values()))

    def give_integers(self, **values):
        references = [self.references[name] for name in values]
        self.fmu.setInteger(references, list(values.values()))

    def real(self, name):
        return self.fmu.getReal([self.references[name]])[0]

    def integer(self, name):
        return self.fmu.getInteger([self.references[name]])[0]

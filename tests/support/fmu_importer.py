"""An FMU in FMPy, call by call."""

import shutil

import fmpy
from fmpy.fmi2 import FMU2Model, FMU2Slave
from fmpy.fmi3 import FMU3Model, FMU3Slave


class Importer:
    """An instance of an FMU for one kind of interface, through initialization at time 0."""

    def __init__(self, path, fmi, model_exchange=False, events=False, begin=True, **times):
        self.description = fmpy.read_model_description(str(path))
        self.folder = fmpy.extract(str(path))
        kind = {(2, True): FMU2Model, (2, False): FMU2Slave, (3, True): FMU3Model, (3, False): FMU3Slave}
        self.fmi, self.references = fmi, {each.name: each.valueReference for each in self.description.modelVariables}
        self.fmu = kind[fmi, model_exchange](
            guid=self.description.guid, unzipDirectory=self.folder, instanceName="one",
            modelIdentifier=self.description.coSimulation.modelIdentifier,
        )  # fmt: skip
        self.fmu.instantiate(**({"eventModeUsed": True} if events else {}))
        if begin:
            self.begin(**times)

    def begin(self, **times):
        """Go through initialization, from time 0 where no other is given."""
        times = {"startTime": 0.0, **times}
        if self.fmi == 2:
            self.fmu.setupExperiment(**times)
        self.fmu.enterInitializationMode(**(times if self.fmi == 3 else {}))
        self.fmu.exitInitializationMode()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.fmu.freeInstance()
        shutil.rmtree(self.folder, ignore_errors=True)

    def give(self, **values):
        references = [self.references[name] for name in values]
        (self.fmu.setReal if self.fmi == 2 else self.fmu.setFloat64)(references, list(values.values()))

    def give_integers(self, **values):
        references = [self.references[name] for name in values]
        (self.fmu.setInteger if self.fmi == 2 else self.fmu.setInt32)(references, list(values.values()))

    def real(self, name):
        return (self.fmu.getReal if self.fmi == 2 else self.fmu.getFloat64)([self.references[name]])[0]

    def integer(self, name):
        return (self.fmu.getInteger if self.fmi == 2 else self.fmu.getInt32)([self.references[name]])[0]
